/** Reads files in a worker: the library of TypeScript declares it only without the DOM. */
declare class FileReaderSync {
  readAsArrayBuffer(file: Blob): ArrayBuffer;
}

// Types of packages that publish none. Only functions used here are declared.

declare module "draco3dgltf/draco_decoder_gltf_nodejs.js" {
  export default function createDecoder(options: { wasmBinary: ArrayBuffer }): Promise<unknown>;
}
