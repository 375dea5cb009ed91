/** Decodes textures with the browser, so that the module contains no image decoders. */

import type { LoadedModel } from "../pkg/cagework";
import type { Texture } from "./messages";

/** Decodes all textures of a model and counts those that fail. Calls `tell` with the fraction done. */
export async function decodeTextures(
  loaded: LoadedModel,
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
      const { width, height, data } = await decode(file, loaded.textureSide);
      textures[index] = { width, height, rgba: new Uint8Array(data.buffer) };
    } catch {
      // A damaged image is replaced by the material's plain colour.
      failed += 1;
    }
  }
  return { textures, failed };
}

/** Decodes an image. If its longer side is more than `side` pixels, scales it down. */
async function decode(file: Blob, side: number): Promise<ImageData> {
  const options: ImageBitmapOptions = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
  const whole = await createImageBitmap(file, options);
  const scale = Math.min(1, side / Math.max(whole.width, whole.height));
  const width = Math.max(1, Math.round(scale * whole.width));
  const height = Math.max(1, Math.round(scale * whole.height));
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) throw new Error("no canvas to decode a texture with");
  context.drawImage(whole, 0, 0, width, height);
  whole.close();
  return context.getImageData(0, 0, width, height);
}
