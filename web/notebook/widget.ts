/**
 * The notebook widget: shows `<cage-deformer>` in a cell's output, and keeps its pose equal to the pose of the widget
 * in Python.
 */

import type { BindReport, Offsets } from "../package/src/contract/generated";
import { CageDeformerElement } from "../package/src/element";
import { compile } from "./open";

/** The model, cage and weights that Python sends. Positions are in object units. */
interface Payload {
  readonly name: string;
  readonly file: DataView;
  /** `[n_cage, 3]`, float64. */
  readonly positions: DataView;
  /** For each face, the number of its corners and then its vertices, uint32. */
  readonly corners: DataView;
  /** Subdivision steps of the cage. */
  readonly smooth: number;
  /** The weights as compressed sparse rows: uint32, uint32 and float32. */
  readonly indptr: DataView;
  readonly indices: DataView;
  readonly data: DataView;
  readonly frames: Offsets["frames"];
  readonly report: BindReport;
}

/** The state that Python shares. */
interface Traits {
  readonly _sent: Payload;
  /** The gzip-compressed wasm file. */
  readonly _wasm: DataView;
  /** Current positions of the cage's vertices, float64, object units. `[n_cage, 3]` */
  readonly pose: DataView;
  readonly theme: "auto" | "dark" | "light";
  /** Height of the element, CSS pixels. */
  readonly height: number;
}

/** The members of anywidget's model that the widget uses. */
interface Model {
  get<K extends keyof Traits>(name: K): Traits[K];
  set<K extends keyof Traits>(name: K, value: Traits[K]): void;
  save_changes(): void;
  on(event: string, listener: () => void): void;
  off(event: string, listener: () => void): void;
}

/** Copies the bytes of a view, which aligns them for arrays of any type. */
const bytes = ({ buffer, byteOffset, byteLength }: DataView): ArrayBuffer =>
  (buffer as ArrayBuffer).slice(byteOffset, byteOffset + byteLength);

/** Whether the notebook has a dark background. */
function isDark(): boolean {
  const { classList, dataset } = document.body;
  const jupyter = dataset.jpThemeLight;
  if (jupyter) return jupyter === "false";
  if (/vscode/.test(classList.value)) return !/vscode-(high-contrast-)?light/.test(classList.value);
  if (classList.contains("dark") || classList.contains("light")) return classList.contains("dark");
  return matchMedia("(prefers-color-scheme: dark)").matches;
}

// The package declares side effects only for its built files, so a bundler would drop the definition in element.ts.
if (!customElements.get("cage-deformer")) customElements.define("cage-deformer", CageDeformerElement);

function render({ model, el }: { model: Model; el: HTMLElement }): () => void {
  compile(bytes(model.get("_wasm")));
  const element = document.createElement("cage-deformer");
  const sent = model.get("_sent");
  const positions = new Float64Array(bytes(sent.positions));
  const cage = {
    positions,
    corners: new Uint32Array(bytes(sent.corners)),
    controls: { smooth: sent.smooth, inner: 0, elements: [], radius: null },
  };
  const weights = {
    indptr: new Uint32Array(bytes(sent.indptr)),
    indices: new Uint32Array(bytes(sent.indices)),
    data: new Float32Array(bytes(sent.data)),
    offsets: { frames: sent.frames, outside: [] },
    controls: positions.length / 3,
  };

  const at = (k: number) => element.origin?.[k % 3] ?? 0;
  const applyStyle = () => {
    const theme = model.get("theme");
    element.setAttribute("theme", theme === "auto" ? (isDark() ? "dark" : "light") : theme);
    element.style.aspectRatio = "auto";
    element.style.height = `${model.get("height")}px`;
  };
  const receivePose = () => {
    const pose = new Float64Array(bytes(model.get("pose")));
    if (element.pose?.length === pose.length) element.pose = pose.map((x, k) => x - at(k));
  };
  const sendPose = () => {
    if (!element.pose) return;
    const pose = Float64Array.from(element.pose, (x, k) => x + at(k));
    model.set("pose", new DataView(pose.buffer));
    model.save_changes();
  };

  applyStyle();
  element.addEventListener("ready", receivePose);
  element.addEventListener("pose", sendPose);
  model.on("change:pose", receivePose);
  model.on("change:theme", applyStyle);
  model.on("change:height", applyStyle);
  el.append(element);
  element.show({ name: sent.name, file: bytes(sent.file), cage, bound: { weights, report: sent.report } });
  return () => {
    model.off("change:pose", receivePose);
    model.off("change:theme", applyStyle);
    model.off("change:height", applyStyle);
    element.remove();
  };
}

export default { render };
