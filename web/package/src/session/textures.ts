/** Textures, decoded by the browser: it knows more formats than we want to carry. */

import type { Loaded } from "../pkg/cagework";
import type { Texture } from "./messages";

/** Larger ones are made smaller, pixels: a preview gains nothing from more, and ten of them must fit a phone. */
const LARGEST = 2048;

/** Decodes all textures of a file that was read, and counts those that could not be. `tell` hears the share done. */
export async function decodeTextures(
  loaded: Loaded,
  tell: (share: number) => void,
): Promise<{ textures: (Texture | null)[]; failed: number }> {
  const textures: (Texture | null)[] = [];
  let failed = 0;
  for (let index = 0; index < loaded.textureCount; index++) {
    tell(index / loaded.textureCount);
    textures[index] = null;
    const bytes = loaded.textureBytes(index);
    if (bytes.length === 0) continue;
    try {
      const file = new Blob([bytes as BlobPart], { type: loaded.textureType(index) });
      const { width, height, data } = await decode(file);
      textures[index] = { width, height, rgba: new Uint8Array(data.buffer) };
    } catch {
      // The shape matters more: the material's plain colour stands in for a damaged image.
      failed += 1;
    }
  }
  return { textures, failed };
}

async function decode(file: Blob): Promise<ImageData> {
  const options: ImageBitmapOptions = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
  const whole = await createImageBitmap(file, options);
  const scale = Math.min(1, LARGEST / Math.max(whole.width, whole.height));
  const width = Math.max(1, Math.round(scale * whole.width));
  const height = Math.max(1, Math.round(scale * whole.height));
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) throw new Error("no canvas to decode a texture with");
  context.drawImage(whole, 0, 0, width, height);
  whole.close();
  return context.getImageData(0, 0, width, height);
}
