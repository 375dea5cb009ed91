// Types of packages that publish none. Only functions used here are declared.

declare module "draco3dgltf" {
  const draco: { createEncoderModule(): Promise<unknown> };
  export default draco;
}

declare module "gltf-validator" {
  interface Message {
    readonly severity: number;
    readonly code: string;
    readonly pointer: string;
    readonly message: string;
  }
  const validator: {
    validateBytes(bytes: Uint8Array): Promise<{ readonly issues: { readonly messages: readonly Message[] } }>;
  };
  export default validator;
}
