/** The shortcut table. The keyboard handler, the tool tips and the shortcut sheet read it. */

import { T } from "../words";

/** When a shortcut applies: always, during a gesture (G, R or S), while the cage is reshaped, or during the tour. */
export type Scope = "page" | "gesture" | "rest" | "tour";

interface Entry {
  readonly keys: readonly string[];
  readonly group: Group;
  readonly scope?: Scope;
  /** Keys that the shortcut sheet shows, if one row of it stands for several commands. */
  readonly shown?: readonly string[];
}

export const GROUPS = ["move", "moving", "select", "look", "cage", "poses", "file"] as const;
export type Group = (typeof GROUPS)[number];

/** Keys have the form that `keyOf` returns; `mod` is Ctrl, or Cmd on a Mac. */
const TABLE = {
  grab: { keys: ["g"], group: "move" },
  rotate: { keys: ["r"], group: "move" },
  scale: { keys: ["s"], group: "move" },
  axisX: { keys: ["x"], group: "moving", scope: "gesture", shown: ["x", "y", "z"] },
  axisY: { keys: ["y"], group: "moving", scope: "gesture" },
  axisZ: { keys: ["z"], group: "moving", scope: "gesture" },
  planeX: { keys: ["shift+x"], group: "moving", scope: "gesture" },
  planeY: { keys: ["shift+y"], group: "moving", scope: "gesture" },
  planeZ: { keys: ["shift+z"], group: "moving", scope: "gesture" },
  keep: { keys: ["enter"], group: "moving", scope: "gesture" },
  cancel: { keys: ["escape"], group: "moving" },
  gizmoMove: { keys: ["w"], group: "move" },
  gizmoRotate: { keys: ["e"], group: "move" },
  gizmoScale: { keys: ["t"], group: "move" },
  toolPull: { keys: ["q"], group: "move" },
  pin: { keys: ["p"], group: "move" },
  toolSelect: { keys: ["shift+q"], group: "move" },
  symmetry: { keys: ["m"], group: "move" },
  proportional: { keys: ["o"], group: "move" },
  nudgeLeft: {
    keys: ["arrowleft"],
    group: "move",
    shown: ["arrowleft", "arrowup", "arrowdown", "arrowright"],
  },
  nudgeRight: { keys: ["arrowright"], group: "move" },
  nudgeUp: { keys: ["arrowup"], group: "move" },
  nudgeDown: { keys: ["arrowdown"], group: "move" },
  nudgeLeftFar: { keys: ["shift+arrowleft"], group: "move" },
  nudgeRightFar: { keys: ["shift+arrowright"], group: "move" },
  nudgeUpFar: { keys: ["shift+arrowup"], group: "move" },
  nudgeDownFar: { keys: ["shift+arrowdown"], group: "move" },
  undo: { keys: ["mod+z"], group: "move" },
  redo: { keys: ["shift+mod+z", "mod+y"], group: "move" },

  selectAll: { keys: ["a"], group: "select" },
  selectNone: { keys: ["alt+a"], group: "select" },
  selectLinked: { keys: ["l"], group: "select" },
  selectInvert: { keys: ["mod+i"], group: "select" },
  boxSelect: { keys: ["b"], group: "select" },
  elementMode: { keys: ["v"], group: "select" },
  previousVertex: { keys: ["["], group: "select" },
  nextVertex: { keys: ["]"], group: "select" },

  frameSelection: { keys: ["f"], group: "look" },
  frameAll: { keys: ["home", "shift+f"], group: "look" },
  viewFront: { keys: ["1"], group: "look" },
  viewRight: { keys: ["3"], group: "look" },
  viewTop: { keys: ["7"], group: "look" },
  viewBack: { keys: ["mod+1"], group: "look" },
  viewLeft: { keys: ["mod+3"], group: "look" },
  viewBottom: { keys: ["mod+7"], group: "look" },
  ortho: { keys: ["5"], group: "look" },
  original: { keys: [" "], group: "look" },
  toggleCage: { keys: ["h"], group: "look" },
  toggleWire: { keys: ["z"], group: "look" },
  heatMap: { keys: ["k"], group: "look" },
  see: { keys: ["n"], group: "look" },

  tour: { keys: ["shift+t"], group: "look" },
  nextStop: {
    keys: ["pagedown", "."],
    group: "look",
    scope: "tour",
    shown: ["pagedown", "pageup", ".", ","],
  },
  previousStop: { keys: ["pageup", ","], group: "look", scope: "tour" },

  restMode: { keys: ["tab"], group: "cage" },
  split: { keys: ["shift+s"], group: "cage", scope: "rest" },
  collapse: { keys: ["shift+c"], group: "cage", scope: "rest" },
  extrude: { keys: ["shift+e"], group: "cage", scope: "rest" },
  remove: { keys: ["delete", "backspace"], group: "cage", scope: "rest" },

  savePose: { keys: ["shift+p"], group: "poses" },
  play: { keys: ["j"], group: "poses" },
  playClip: { keys: ["shift+j"], group: "poses" },
  resetPose: { keys: ["alt+g"], group: "poses" },

  open: { keys: ["mod+o"], group: "file" },
  saveProject: { keys: ["mod+s"], group: "file" },
  bind: { keys: ["mod+enter"], group: "file" },
  sheet: { keys: ["?"], group: "file" },
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

/**
 * Converts a key press to the form of the table. With Alt, letters come from the physical key: Alt+A types "å" on a
 * Mac.
 */
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

/** Commands that also apply during a gesture: they cancel it, start another one, or change how far it reaches. */
const DURING_GESTURE: readonly Command[] = ["cancel", "grab", "rotate", "scale", "proportional"];

/** Finds the command of a key press. During a gesture, all others need the scope "gesture". */
export function commandOf(
  event: KeyPress,
  scopes: Partial<Record<Exclude<Scope, "page">, boolean>>,
): Command | undefined {
  const key = keyOf(event);
  const matches = SHORTCUTS.filter((shortcut) => shortcut.keys.includes(key));
  const of = (scope: Scope) => matches.find((shortcut) => (shortcut.scope ?? "page") === scope)?.command;
  if (scopes.gesture) {
    const page = of("page");
    return of("gesture") ?? (page && DURING_GESTURE.includes(page) ? page : undefined);
  }
  return (scopes.rest ? of("rest") : undefined) ?? (scopes.tour ? of("tour") : undefined) ?? of("page");
}

const ARROWS = { arrowleft: "←", arrowright: "→", arrowup: "↑", arrowdown: "↓" };
const MAC_KEYS = { mod: "⌘", shift: "⇧", alt: "⌥" };

/** Labels of the keys of a combination: "shift+mod+z" -> ["Shift", "Ctrl", "Z"], on a Mac ["⇧", "⌘", "Z"]. */
export function caps(keys: string, mac: boolean): string[] {
  const names: Readonly<Record<string, string>> = { ...ARROWS, ...T.keys, ...(mac ? MAC_KEYS : {}) };
  return keys.split("+").map((part) => names[part] ?? part.toUpperCase());
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
