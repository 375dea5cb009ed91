/** Tools in the view while the cage is reshaped. */

import type { App } from "../app";
import type { Element as CageElement, RestEdit } from "../contract";
import { T } from "../words";
import { IconButton } from "./controls";
import type { IconName } from "./icons";
import { Toolbar } from "./toolbar";

const EDITS: readonly (readonly [RestEdit, IconName, "split" | "collapse" | "extrude" | "remove"])[] = [
  ["split_edge", "split", "split"],
  ["collapse_edge", "merge", "collapse"],
  ["extrude_face", "extrude", "extrude"],
  ["delete_vertex", "trash", "remove"],
];

export function ReshapeTools({ app }: { app: App }) {
  const { tools, selected } = app.store.get();
  const { element } = tools;
  return (
    <Toolbar label={T.cage.tools} kind="reshape">
      {EDITS.map(([edit, icon, command]) => (
        <IconButton
          key={edit}
          icon={icon}
          label={T.cage.edits[edit]}
          shortcut={app.key(command)}
          disabled={selected.count < need(edit, element) || !suits(edit, element)}
          onClick={() => app.edit.restEdit(deletion(edit, element))}
        />
      ))}
      <IconButton
        icon="grow"
        label={T.cage.repairs.grow()}
        tip={T.cage.growTip}
        onClick={() => void app.cage.repair("grow")}
      />
    </Toolbar>
  );
}

function suits(edit: RestEdit, element: CageElement): boolean {
  if (edit === "split_edge" || edit === "collapse_edge") return element === "edge";
  if (edit === "extrude_face") return element === "face";
  return element !== "edge";
}

function need(edit: RestEdit, element: CageElement): number {
  if (edit === "extrude_face") return 3;
  if (edit === "delete_vertex") return element === "face" ? 3 : 1;
  return 2;
}

function deletion(edit: RestEdit, element: CageElement): RestEdit {
  return edit === "delete_vertex" && element === "face" ? "delete_face" : edit;
}
