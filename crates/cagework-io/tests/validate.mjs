// Validates all .glb files in a directory with the Khronos glTF validator. Prints errors and warnings; exits
// with 1 on errors.
//
// usage: node validate.mjs DIRECTORY

import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import validator from "gltf-validator";

const directory = process.argv[2];
if (directory === undefined) {
  console.error("usage: node validate.mjs DIRECTORY");
  process.exit(2);
}
const ERROR = 0;
const WARNING = 1;

const names = readdirSync(directory)
  .filter((name) => name.endsWith(".glb"))
  .sort();
let errors = 0;
for (const name of names) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(join(directory, name))), {
    uri: name,
  });
  errors += report.issues.numErrors;
  for (const { severity, code, message, pointer } of report.issues.messages) {
    if (severity <= WARNING) {
      console.log(`${name}: ${severity === ERROR ? "error" : "warning"} ${code} at ${pointer}: ${message}`);
    }
  }
}
console.log(`${names.length} files, ${errors} errors`);
// An empty directory means that no samples were written.
process.exit(errors > 0 || names.length === 0 ? 1 : 0);
