/** Links: sample, pose and view, or a stop of a tour, in the URL's fragment, which browsers do not send to servers. */

import type { CageControls, CameraView, SceneOptions } from "./contract";
import type { TourPlace } from "./state";
import { PageError } from "./strings";
import { T } from "./words";

/** Camera, selected vertices and scene options of a link. */
export interface SharedView {
  readonly camera: CameraView;
  readonly selected: readonly number[];
  readonly scene: Partial<SceneOptions>;
}

/** Smoothing of the cage, and its inner controls with their rest positions. */
export interface SharedControls {
  readonly controls: CageControls;
  /** Rest positions of the inner controls, object units. `[n_inner, 3]` */
  readonly inner: readonly number[];
}

/** The content of a share link. */
export interface ShareLink {
  /** Identifier of the sample. Links contain no files, so only samples can be shared. */
  sample: string;
  /** The pose, encoded by `Engine.encodePose`. */
  pose?: Uint8Array;
  seen?: SharedView;
  /** Undefined for a cage without smoothing and without inner controls. */
  controls?: SharedControls;
  /** Index of the clip that plays. */
  clip?: number;
}

/** Maximum length of a fragment that is decoded, characters. A pose of 400 cage vertices takes about 3 kB. */
const MAX_FRAGMENT_LENGTH = 16_384;

/** Encodes the fragment of a link, including the #. */
export async function encodeShare(shared: ShareLink): Promise<string> {
  const fields = new URLSearchParams({ sample: shared.sample });
  if (shared.pose && shared.pose.length > 0) fields.set("pose", toBase64Url(await pack(shared.pose)));
  for (const key of ["seen", "controls"] as const) {
    const value = shared[key];
    if (value) fields.set(key, toBase64Url(await pack(new TextEncoder().encode(JSON.stringify(value)))));
  }
  if (shared.clip !== undefined) fields.set("clip", String(shared.clip));
  return `#${fields}`;
}

/** Decodes the fragment of an address. Returns undefined if it is not a share link; throws if the link is damaged. */
export async function decodeShare(fragment: string): Promise<ShareLink | undefined> {
  const fields = new URLSearchParams(fragment.slice(1));
  const sample = fields.get("sample");
  const pose = fields.get("pose");
  const seen = fields.get("seen");
  const controls = fields.get("controls");
  const clip = fields.get("clip");
  if (sample === null && pose === null) return undefined;
  if (!sample) throw new PageError(T.link.noSample);
  if (fragment.length > MAX_FRAGMENT_LENGTH) throw new PageError(T.link.long(MAX_FRAGMENT_LENGTH));
  return {
    sample,
    ...(pose === null ? {} : { pose: await read("pose", pose) }),
    ...(seen === null ? {} : { seen: parse(await read("view", seen)) }),
    ...(controls === null ? {} : { controls: parseControls(await read("controls", controls)) }),
    ...(clip === null ? {} : { clip: parseClip(clip) }),
  };
}

async function read(what: "pose" | "view" | "controls", text: string): Promise<Uint8Array> {
  try {
    return await through(fromBase64Url(text), new DecompressionStream("deflate-raw"));
  } catch {
    throw new PageError(T.link.unreadable[what]);
  }
}

/** Decodes camera and scene. Checks only the structure of the JSON; the engine checks the values. */
function parse(json: Uint8Array): SharedView {
  const seen: Partial<SharedView> | null = JSON.parse(new TextDecoder().decode(json));
  if (!seen?.camera || !Array.isArray(seen.selected)) throw new PageError(T.link.unreadable.view);
  return { camera: seen.camera, selected: seen.selected, scene: { ...seen.scene } };
}

function parseClip(text: string): number {
  if (!/^\d{1,4}$/.test(text)) throw new PageError(T.link.unreadable.clip);
  return Number(text);
}

/** Decodes inner controls. Checks only the structure of the JSON; the engine checks the values. */
function parseControls(json: Uint8Array): SharedControls {
  const said: Partial<SharedControls> | null = JSON.parse(new TextDecoder().decode(json));
  if (!said?.controls || !Array.isArray(said.inner)) throw new PageError(T.link.unreadable.controls);
  return { controls: said.controls, inner: said.inner };
}

async function through(
  data: Uint8Array,
  stream: CompressionStream | DecompressionStream,
): Promise<Uint8Array> {
  const body = new Blob([new Uint8Array(data)]).stream().pipeThrough(stream);
  return new Uint8Array(await new Response(body).arrayBuffer());
}

function pack(data: Uint8Array): Promise<Uint8Array> {
  return through(data, new CompressionStream("deflate-raw"));
}

/** Encodes bytes as URL-safe Base64 without padding. */
export function toBase64Url(data: Uint8Array): string {
  let binary = "";
  for (const byte of data) binary += String.fromCharCode(byte);
  return btoa(binary).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** Decodes URL-safe Base64; throws on other characters. */
export function fromBase64Url(text: string): Uint8Array {
  const binary = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
  return Uint8Array.from(binary, (letter) => letter.charCodeAt(0));
}

/** Names of the tours in links. */
const TOUR_KEYS = { first: "first-steps", how: "tour" } as const;

/** Returns the stop of a tour that the fragment of an address names; undefined if it names none. */
export function stopOf(fragment: string): TourPlace | undefined {
  const parameters = new URLSearchParams(fragment.slice(1));
  for (const name of ["first", "how"] as const) {
    const said = parameters.get(TOUR_KEYS[name]);
    if (said !== null) return { name, stop: Math.max(0, (Number.parseInt(said, 10) || 1) - 1) };
  }
  return undefined;
}

/** Returns the fragment of a link to a stop of a tour. */
export const linkOf = ({ name, stop }: TourPlace): string => `#${TOUR_KEYS[name]}=${stop + 1}`;
