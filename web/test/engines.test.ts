import { readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, it } from "vitest";

const read = (name: string) => JSON.parse(readFileSync(join(import.meta.dirname, "../..", name), "utf8"));

/** Whether an npm version range such as "^18.0.0 || >=20.9" allows the version [major, minor]. */
function allows(range: string, [major = 0, minor = 0]: readonly number[]): boolean {
  return range.split("||").some((part) => {
    const bounds = part.trim().split(/(?<=[\d*])\s+/);
    return bounds.every((bound) => {
      const [, sign = "", a = "0", b = "0"] = /^([<>=^~]*)\s*v?(\d+|\*)(?:\.(\d+))?/.exec(bound) ?? [];
      const [x, y] = [Number(a), Number(b)];
      if (a === "*") return true;
      if (sign.startsWith("<")) return major < x || (major === x && minor < y);
      const isAtLeast = major > x || (major === x && minor >= y);
      return isAtLeast && (sign.startsWith(">") || major === x);
    });
  });
}

it("npm warns of no package on the oldest Node version that package.json allows", () => {
  const oldest = read("package.json").engines.node.match(/\d+/g).map(Number);
  const packages = Object.entries(read("package-lock.json").packages) as [
    string,
    { engines?: { node?: string } },
  ][];
  const refuse = packages.filter(([, { engines }]) => engines?.node && !allows(engines.node, oldest));
  expect(refuse.map(([name, { engines }]) => `${name} ${engines?.node}`)).toEqual([]);
  expect([
    allows(">=22.12.0", oldest),
    allows("^18.0.0 || ^20.0.0", oldest),
    allows(">= 10.13 < 21", oldest),
  ]).toEqual([false, true, true]);
});
