/** The cage and what may be wrong with it. */

import type { Bounds } from "./session";

export interface CageInfo {
  readonly vertices: number;
  readonly edges: number;
  readonly faces: number;
  readonly triangles: number;
  readonly bounds: Bounds;
  /** Whole sentences about what was mended. */
  readonly notices: readonly string[];
}

/** `usable` false: a draft that is drawn with its faults marked, but cannot be bound. */
export interface CageState {
  readonly usable: boolean;
  readonly info: CageInfo;
}

/** Cage as arrays: positions `[n_cage, 3]`; for each face the number of its corners, then them. */
export interface CageArrays {
  readonly positions: Float32Array;
  readonly corners: Uint32Array;
}

/** What is wrong with a cage, and where: in it, or in the model (`outside`). */
export interface Check {
  readonly problems: readonly Problem[];
  readonly vertices: Uint32Array;
  readonly edges: Uint32Array;
  readonly faces: Uint32Array;
  readonly points: Float32Array;
  readonly outside: Uint32Array;
}

/** A cage that a worker has looked at; null while it has not. */
export interface CheckedCage extends CageArrays {
  readonly check: Check | null;
}

export interface Problem {
  /** Variant: "OpenEdges", "FlippedFaces", "SelfIntersection", "Outside", "Thin", "NonManifold", "Degenerate", ... */
  readonly kind: string;
  readonly severity: "error" | "warning" | "note";
  /** A whole sentence with numbers. */
  readonly message: string;
  readonly count: number;
  /** A repair that helps: pass `kind` to `Session.repair`, show `label` on the button ("Fill 2 holes"). */
  readonly fix: Mend | null;
}

export interface Mend {
  readonly kind: RepairKind | "refine_grid";
  readonly label: string;
  /** Cells of the grid that "refine_grid" asks for: the cage stays as it is. */
  readonly cells: number | null;
}
export type RepairKind = "fill_holes" | "turn_faces" | "grow" | "drop_parts" | "weld" | "regenerate";

export interface CageOptions {
  /** Vertices wanted, 12 to 400. */
  readonly vertices: number;
  /** Distance from the model, fraction of its diagonal, 0 to 0.25. */
  readonly margin: number;
  /** Mirror-symmetric in x, if the model is (found out by itself with "auto"). */
  readonly symmetry: "auto" | "on" | "off";
  /** Voxels along the model's longest side, 8 to 128: gaps narrower than three of them are closed. 0: by the vertices. */
  readonly voxels: number;
}

/** What the cage is asked for; `shape` and `per_component` go beyond the least. */
export interface CageWish extends CageOptions {
  readonly shape: "follow" | "hull";
  /** A cage for each separate part of the model, instead of one for all. */
  readonly per_component: boolean;
}

/** Edits of the rest cage's topology, on the selection. */
export type RestEdit = "split_edge" | "collapse_edge" | "extrude_face" | "delete_vertex" | "delete_face";
