/** The shortcut table. The keyboard handler, the tool tips and the shortcut sheet read it. */

/** Where a shortcut applies: everywhere, during a gesture (G, R or S), while the rest cage is edited, or on the tour. */
export type Scope = "page" | "gesture" | "rest" | "tour";

interface Entry {
  readonly keys: readonly string[];
  readonly label: string;
  readonly group: Group;
  readonly scope?: Scope;
  /** Keys shown on the sheet, where one row stands for several commands. */
  readonly shown?: readonly string[];
}

export const GROUPS = ["Move", "While moving", "Select", "Look", "Cage", "Poses", "File"] as const;
export type Group = (typeof GROUPS)[number];

/** Keys have the form that `keyOf` returns; `mod` is Ctrl, or Cmd on a Mac. */
const TABLE = {
  grab: { keys: ["g"], label: "Move the selection", group: "Move" },
  rotate: { keys: ["r"], label: "Rotate", group: "Move" },
  scale: { keys: ["s"], label: "Scale", group: "Move" },
  axisX: {
    keys: ["x"],
    label: "Only along this axis; with Shift, along the other two",
    group: "While moving",
    scope: "gesture",
    shown: ["x", "y", "z"],
  },
  axisY: { keys: ["y"], label: "", group: "While moving", scope: "gesture" },
  axisZ: { keys: ["z"], label: "", group: "While moving", scope: "gesture" },
  planeX: { keys: ["shift+x"], label: "", group: "While moving", scope: "gesture" },
  planeY: { keys: ["shift+y"], label: "", group: "While moving", scope: "gesture" },
  planeZ: { keys: ["shift+z"], label: "", group: "While moving", scope: "gesture" },
  keep: {
    keys: ["enter"],
    label: "Keep the move; a click does too",
    group: "While moving",
    scope: "gesture",
  },
  cancel: {
    keys: ["escape"],
    label: "Cancel the move; otherwise close the open panel",
    group: "While moving",
  },
  gizmoMove: { keys: ["w"], label: "Gizmo to move", group: "Move" },
  gizmoRotate: { keys: ["e"], label: "Gizmo to rotate", group: "Move" },
  gizmoScale: { keys: ["t"], label: "Gizmo to scale", group: "Move" },
  toolPull: { keys: ["q"], label: "Pull the model", group: "Move" },
  pin: { keys: ["p"], label: "Pin or unpin the point under the pointer", group: "Move" },
  toolSelect: { keys: ["shift+q"], label: "Only the cage: select and drag", group: "Move" },
  symmetry: { keys: ["m"], label: "Mirror across X", group: "Move" },
  proportional: { keys: ["o"], label: "Proportional editing; the wheel sets the reach", group: "Move" },
  nudgeLeft: {
    keys: ["arrowleft"],
    label: "Nudge the selection, or pull the model; with Shift, ten times as far",
    group: "Move",
    shown: ["arrowleft", "arrowup", "arrowdown", "arrowright"],
  },
  nudgeRight: { keys: ["arrowright"], label: "", group: "Move" },
  nudgeUp: { keys: ["arrowup"], label: "", group: "Move" },
  nudgeDown: { keys: ["arrowdown"], label: "", group: "Move" },
  nudgeLeftFar: { keys: ["shift+arrowleft"], label: "", group: "Move" },
  nudgeRightFar: { keys: ["shift+arrowright"], label: "", group: "Move" },
  nudgeUpFar: { keys: ["shift+arrowup"], label: "", group: "Move" },
  nudgeDownFar: { keys: ["shift+arrowdown"], label: "", group: "Move" },
  undo: { keys: ["mod+z"], label: "Undo", group: "Move" },
  redo: { keys: ["shift+mod+z", "mod+y"], label: "Redo", group: "Move" },

  selectAll: { keys: ["a"], label: "Select all", group: "Select" },
  selectNone: { keys: ["alt+a"], label: "Select nothing", group: "Select" },
  selectLinked: { keys: ["l"], label: "Select connected vertices", group: "Select" },
  selectInvert: { keys: ["mod+i"], label: "Invert the selection", group: "Select" },
  boxSelect: { keys: ["b"], label: "Select with a box", group: "Select" },
  elementMode: { keys: ["v"], label: "Vertices, edges or faces", group: "Select" },
  previousVertex: { keys: ["["], label: "Previous vertex", group: "Select" },
  nextVertex: { keys: ["]"], label: "Next vertex", group: "Select" },

  frameSelection: { keys: ["f"], label: "Frame the selection", group: "Look" },
  frameAll: { keys: ["home", "shift+f"], label: "Frame everything", group: "Look" },
  viewFront: { keys: ["1"], label: "Front; with Ctrl, back", group: "Look" },
  viewRight: { keys: ["3"], label: "Right; with Ctrl, left", group: "Look" },
  viewTop: { keys: ["7"], label: "Top; with Ctrl, bottom", group: "Look" },
  viewBack: { keys: ["mod+1"], label: "", group: "Look" },
  viewLeft: { keys: ["mod+3"], label: "", group: "Look" },
  viewBottom: { keys: ["mod+7"], label: "", group: "Look" },
  ortho: { keys: ["5"], label: "Perspective or parallel", group: "Look" },
  original: { keys: [" "], label: "Hold: show the original", group: "Look" },
  toggleCage: { keys: ["h"], label: "Hide or show the cage", group: "Look" },
  toggleWire: { keys: ["z"], label: "The model at rest, as wireframe", group: "Look" },
  heatMap: { keys: ["k"], label: "Weights of the selected vertex", group: "Look" },
  see: { keys: ["n"], label: "The See panel", group: "Look" },

  tour: { keys: ["shift+t"], label: "The tour, ten stops", group: "Look" },
  nextStop: {
    keys: ["pagedown", "."],
    label: "Next or previous stop of the tour",
    group: "Look",
    scope: "tour",
    shown: ["pagedown", "pageup", ".", ","],
  },
  previousStop: { keys: ["pageup", ","], label: "", group: "Look", scope: "tour" },

  restMode: { keys: ["tab"], label: "Reshape the cage, or pose", group: "Cage" },
  split: { keys: ["shift+s"], label: "Split an edge", group: "Cage", scope: "rest" },
  collapse: { keys: ["shift+c"], label: "Collapse an edge", group: "Cage", scope: "rest" },
  extrude: { keys: ["shift+e"], label: "Extrude a face", group: "Cage", scope: "rest" },
  remove: {
    keys: ["delete", "backspace"],
    label: "Delete, and fill the gap",
    group: "Cage",
    scope: "rest",
  },

  savePose: { keys: ["shift+p"], label: "Save this pose", group: "Poses" },
  play: { keys: ["j"], label: "Play the poses, or stop", group: "Poses" },
  playClip: { keys: ["shift+j"], label: "Play the model's clip, or pause", group: "Poses" },
  resetPose: { keys: ["alt+g"], label: "Back to the rest pose", group: "Poses" },

  open: { keys: ["mod+o"], label: "Open a file", group: "File" },
  saveProject: { keys: ["mod+s"], label: "Save the project", group: "File" },
  bind: { keys: ["mod+enter"], label: "Bind", group: "File" },
  sheet: { keys: ["?"], label: "This sheet", group: "File" },
} as const satisfies Record<string, Entry>;

export type Command = keyof typeof TABLE;

export interface Shortcut extends Entry {
  readonly command: Command;
}

export const SHORTCUTS: readonly Shortcut[] = (Object.keys(TABLE) as Command[]).map((command) => {
  const entry: Entry = TABLE[command];
  return { command, ...entry };
});

export interface KeyPress {
  readonly key: string;
  readonly code: string;
  readonly ctrlKey: boolean;
  readonly metaKey: boolean;
  readonly altKey: boolean;
  readonly shiftKey: boolean;
}

/** A key press in the form of the table. With Alt, letters come from the physical key: Alt+A types "å" on a Mac. */
export function keyOf(event: KeyPress): string {
  const place = /^(?:Key|Digit)(.)$/.exec(event.code)?.[1];
  const mod = event.ctrlKey || event.metaKey;
  const numpad = /^Numpad(\d)$/.exec(event.code)?.[1];
  const typed = event.key.toLowerCase();
  const key = numpad ?? ((event.altKey || mod) && place ? place.toLowerCase() : typed);
  // Omit Shift for signs such as "?", which need it on most keyboards.
  const sign = key.length === 1 && !/[a-z0-9 ]/.test(key);
  return `${event.shiftKey && !sign ? "shift+" : ""}${mod ? "mod+" : ""}${event.altKey ? "alt+" : ""}${key}`;
}

/** The command of a key press. During a gesture, only its own commands and a few others apply. */
export function commandOf(
  event: KeyPress,
  scopes: Partial<Record<Exclude<Scope, "page">, boolean>>,
): Command | undefined {
  const key = keyOf(event);
  const matches = SHORTCUTS.filter((shortcut) => shortcut.keys.includes(key));
  const of = (scope: Scope) => matches.find((shortcut) => (shortcut.scope ?? "page") === scope)?.command;
  if (scopes.gesture) {
    const page = of("page");
    const allowed =
      page === "cancel" ||
      page === "grab" ||
      page === "rotate" ||
      page === "scale" ||
      page === "proportional";
    return of("gesture") ?? (allowed ? page : undefined);
  }
  return (scopes.rest ? of("rest") : undefined) ?? (scopes.tour ? of("tour") : undefined) ?? of("page");
}

const NAMES: Record<string, string> = {
  arrowleft: "←",
  arrowright: "→",
  arrowup: "↑",
  arrowdown: "↓",
  " ": "Space",
  escape: "Esc",
  delete: "Del",
  pagedown: "PgDn",
  pageup: "PgUp",
};

/** Key caps of a combination: "shift+mod+z" -> ["Shift", "Ctrl", "Z"], or with Cmd on a Mac. */
export function caps(keys: string, mac: boolean): string[] {
  return keys.split("+").map((part) => {
    if (part === "mod") return mac ? "⌘" : "Ctrl";
    if (part === "shift") return mac ? "⇧" : "Shift";
    if (part === "alt") return mac ? "⌥" : "Alt";
    const name = NAMES[part];
    if (name) return name;
    return part.length === 1 ? part.toUpperCase() : part.charAt(0).toUpperCase() + part.slice(1);
  });
}

/** The first key combination of a command, for tool tips. */
export function shortcutText(command: Command, mac: boolean): string {
  const keys = TABLE[command].keys[0];
  return caps(keys, mac).join(mac ? "" : "+");
}

/** Whether this is a Mac, which uses Cmd instead of Ctrl. */
export function isMac(platform: string): boolean {
  return /mac|iphone|ipad/i.test(platform);
}
