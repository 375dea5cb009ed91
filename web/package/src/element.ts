/**
 * `<cage-deformer src="fox.glb">`: shows a model in a cage whose vertices can be dragged. Documented in
 * custom-elements.json.
 */

import { poseOf } from "./check";
import { CAGE_DEFAULTS, RIG_DEFAULTS } from "./contract/generated";
import { attachPointer } from "./element/pointer";
import { type OpenedModel, openView, sceneOf, type View } from "./element/view";
import { named } from "./session/client";
import type { BindResult, Cage, File, NameOption } from "./types";

/** Maximum device pixel ratio. A ratio of 3 takes 2.25 times as many pixels as 2, for a barely visible difference. */
const MAX_PIXEL_RATIO = 2;
/** Default number of cells along the cage's longest side: automatic. */
const GRID = 0;

const STYLE = `
  :host { display: block; position: relative; min-height: 240px; aspect-ratio: 4 / 3; overflow: hidden;
    background: #1b1d22; color: #e8eaee; touch-action: none; }
  :host([theme="light"]) { background: #f2f3f5; color: #22252b; }
  :host([hidden]) { display: none; }
  canvas { display: block; position: absolute; inset: 0; width: 100%; height: 100%; }
  p { position: absolute; left: 12px; right: 12px; bottom: 12px; margin: 0; font: 14px/1.4 system-ui, sans-serif;
    pointer-events: none; text-align: center; text-wrap: balance; }
`;

/**
 * A model's file, and optionally a cage for it and the result of `bind`. Without `cage`, the element uses the cage of a
 * project file or generates one. Without `bound`, it binds the model.
 */
export interface Source extends NameOption {
  readonly file: File;
  readonly cage?: Cage | undefined;
  /** Result of `bind` for the model and `cage`. */
  readonly bound?: BindResult | undefined;
}

// Servers have no HTMLElement. They can import this module, but it defines no element there.
const Base: typeof HTMLElement = globalThis.HTMLElement ?? (class {} as typeof HTMLElement);

export class CageDeformerElement extends Base {
  static readonly observedAttributes = ["src", "vertices", "grid", "theme"];

  #view: Promise<View> | undefined;
  /** The view that `#view` has resolved to; undefined while the view opens. */
  #shown: View | undefined;
  /** Number of calls of `#open` and `#close`. A result that belongs to an earlier call is ignored. */
  #asked = 0;
  #bound: Promise<OpenedModel> | undefined;
  /** The argument of `show`, until `src` changes. */
  #source: Source | undefined;
  #canvas: HTMLCanvasElement | undefined;
  #said: HTMLElement | undefined;
  /** Cancels the drag in progress. */
  #release: (() => void) | undefined;
  readonly #sizes = globalThis.ResizeObserver && new ResizeObserver(() => this.#resize());

  connectedCallback(): void {
    this.#draw();
    this.#sizes.observe(this);
    this.#shown?.engine.setScene(sceneOf(this.getAttribute("theme")));
    if (!this.#bound) this.#open();
  }

  disconnectedCallback(): void {
    // Moving an element within the page disconnects and reconnects it: keep its model in that case.
    queueMicrotask(() => {
      if (this.isConnected) return;
      this.#sizes.disconnect();
      this.#close();
    });
  }

  attributeChangedCallback(name: string, before: string | null, now: string | null): void {
    if (before === now) return;
    if (name === "theme") {
      this.#shown?.engine.setScene(sceneOf(now));
      return;
    }
    if (name === "src") this.#source = undefined;
    this.#reopen();
  }

  /** Shows a model from memory instead of `src`. The events `ready` and `error` report the result. */
  show(source: Source): void {
    if (source.bound && !source.cage)
      throw named("Missing", "bound was given without the cage it belongs to");
    this.#source = source;
    this.#reopen();
  }

  #reopen(): void {
    if (this.isConnected && this.shadowRoot) this.#open();
    // The element is not connected yet, or is being moved: `connectedCallback` will open the model.
    else this.#bound = undefined;
  }

  get src(): string | null {
    return this.getAttribute("src");
  }
  set src(src: string | null) {
    if (src === null) this.removeAttribute("src");
    else this.setAttribute("src", src);
  }

  /**
   * Positions of the cage's vertices, `[n_cage, 3]`, object units; null without a cage. Set it to an array of that
   * length to pose, or to null for the rest pose.
   */
  get pose(): Float32Array | null {
    const positions = this.#shown?.engine.cagePositions();
    return positions?.length ? positions : null;
  }
  set pose(posed: ArrayLike<number> | null) {
    const engine = this.#shown?.engine;
    if (!engine?.bound) throw named("Missing", "the model has no cage yet: wait for the `ready` event");
    const rest = engine.restPositions();
    engine.setCagePositions(posed === null ? rest : poseOf(posed, rest));
  }

  /** Origin of `pose`, `[3]`, object units. Not zero for models far from the world's origin, as in map coordinates. */
  get origin(): Float64Array | null {
    return this.#shown?.engine.origin() ?? null;
  }

  /**
   * Returns the posed model as a GLB, with its rig, clips, morph targets and materials. For a project with several
   * models, returns the first model. Waits until the model is bound.
   */
  async export(): Promise<Uint8Array<ArrayBuffer>> {
    if (!this.#bound) throw named("Missing", "there is nothing to export: the element has no model");
    await this.#bound;
    const engine = this.#shown?.engine;
    if (!engine) throw named("Missing", "the element was closed before it could export");
    return engine.exportGlb(0, RIG_DEFAULTS, 0) as Uint8Array<ArrayBuffer>;
  }

  #draw(): void {
    if (this.shadowRoot) return;
    const root = this.attachShadow({ mode: "open" });
    const style = new CSSStyleSheet();
    style.replaceSync(STYLE);
    // Use a constructed style sheet, because a Content-Security-Policy may forbid style elements.
    root.adoptedStyleSheets = [style];
    this.#said = document.createElement("p");
    this.#said.setAttribute("role", "status");
    root.append(this.#freshCanvas(), this.#said);
    this.#release = attachPointer(
      this,
      () => this.#shown?.engine,
      () => this.dispatchEvent(new CustomEvent("pose", { detail: this.pose })),
    );
  }

  #freshCanvas(): HTMLCanvasElement {
    const canvas = document.createElement("canvas");
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", this.getAttribute("aria-label") ?? "A 3-D model in a cage");
    this.#canvas?.replaceWith(canvas);
    this.#canvas = canvas;
    return canvas;
  }

  #open(): void {
    this.#asked += 1;
    const source = this.#source ?? this.src;
    this.#bound = undefined;
    if (source === null) {
      this.#close();
      this.#say("");
      return;
    }
    const asked = this.#asked;
    const opening = this.#show(source, asked);
    this.#bound = opening;
    opening.then(
      (ready) => {
        if (asked !== this.#asked) return;
        this.#say("");
        this.dispatchEvent(new CustomEvent("ready", { detail: ready }));
      },
      (error: unknown) => {
        if (asked === this.#asked) this.#fail(error);
      },
    );
  }

  async #show(source: Source | string, asked: number): Promise<OpenedModel> {
    this.#say("Opening");
    const number = (name: string, usual: number) => Number(this.getAttribute(name) ?? usual);
    const given = typeof source === "string" ? download(new URL(source, this.baseURI)) : source;
    const [view, { name = "model.glb", file, cage, bound }] = await Promise.all([this.#opened(), given]);
    if (asked !== this.#asked) throw named("Cancelled", "another file was opened");
    const wanted = {
      name,
      file: file instanceof Blob ? file : new Blob([file as BlobPart]),
      vertices: number("vertices", CAGE_DEFAULTS.target),
      grid: number("grid", GRID),
      cage,
      bound,
    };
    return view.open(wanted, (what, fraction) => {
      if (asked === this.#asked) this.#say(fraction > 0 ? `${what}: ${Math.round(100 * fraction)} %` : what);
    });
  }

  #opened(): Promise<View> {
    if (this.#view) return this.#view;
    const opening = openView(
      { canvas: () => this.#canvas ?? this.#freshCanvas(), freshCanvas: () => this.#freshCanvas() },
      (error) => this.#fail(error),
    );
    this.#view = opening;
    opening.then(
      (view) => {
        if (this.#view !== opening) return;
        this.#shown = view;
        view.engine.setScene(sceneOf(this.getAttribute("theme")));
        this.#resize();
      },
      () => {
        // Forget the failed view, so that setting src again opens a new one.
        if (this.#view === opening) this.#view = undefined;
      },
    );
    return opening;
  }

  #close(): void {
    this.#asked += 1;
    this.#release?.();
    const view = this.#view;
    this.#view = this.#shown = this.#bound = undefined;
    view?.then((view) => view.close()).catch(() => undefined);
    // Replace the canvas, because it cannot be used with another GPU device.
    this.#freshCanvas();
  }

  #resize(): void {
    const { clientWidth, clientHeight } = this;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.#shown?.engine.resize(clientWidth, clientHeight, Math.min(MAX_PIXEL_RATIO, devicePixelRatio));
  }

  #say(words: string): void {
    if (this.#said) this.#said.textContent = words;
  }

  #fail(error: unknown): void {
    const message = error instanceof Error ? error.message : String(error);
    this.#say(message);
    this.dispatchEvent(new ErrorEvent("error", { error, message }));
  }
}

async function download(address: URL): Promise<Source> {
  const fail = (why: string | number) =>
    named("Unreadable", `${address.href} could not be downloaded (${why})`);
  const unreachable = (error: unknown) => {
    throw fail(error instanceof Error ? error.message : String(error));
  };
  const response = await fetch(address).catch(unreachable);
  if (!response.ok) throw fail(response.status);
  return { name: nameIn(address), file: await response.blob().catch(unreachable) };
}

function nameIn(address: URL): string | undefined {
  const last = address.pathname.split("/").at(-1) || undefined;
  try {
    return last && decodeURIComponent(last);
  } catch {
    // A "%" that begins no escape belongs to the name.
    return last;
  }
}

if (globalThis.customElements && !customElements.get("cage-deformer")) {
  customElements.define("cage-deformer", CageDeformerElement);
}

declare global {
  interface HTMLElementTagNameMap {
    "cage-deformer": CageDeformerElement;
  }
}
