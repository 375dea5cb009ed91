// Packages without types of their own: what is used of them.

declare module "draco3dgltf/draco_decoder_gltf_nodejs.js" {
  /** Opens the decoder with its wasm file. */
  export default function createDecoder(options: { wasmBinary: ArrayBuffer }): Promise<unknown>;
}
