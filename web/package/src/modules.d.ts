// Types of packages that ship none; only the parts used here.

declare module "draco3dgltf/draco_decoder_gltf_nodejs.js" {
  export default function createDecoder(options: { wasmBinary: ArrayBuffer }): Promise<unknown>;
}
