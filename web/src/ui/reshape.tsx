/** Tools in the view while the cage is reshaped. */

import type { App } from "../app";
import type { Element as CageElement } from "../contract";
import type { Command } from "../input/shortcuts";
import { T } from "../words";
import { IconButton } from "./controls";
import type { IconName } from "./icons";
import { Toolbar } from "./toolbar";

type Vertices = Partial<Record<CageElement, number>>;

/** Each edit, and how many vertices must be selected for it, by the kind of element that is selected. */
const EDITS: readonly (readonly [keyof typeof T.cage.edits, IconName, Command, Vertices])[] = [
  ["split_edge", "split", "split", { edge: 2 }],
  ["collapse_edge", "merge", "collapse", { edge: 2 }],
  ["extrude_face", "extrude", "extrude", { face: 3 }],
  ["delete_vertex", "trash", "remove", { vertex: 1, face: 3 }],
];

export function ReshapeTools({ app }: { app: App }) {
  const { tools, selected } = app.store.get();
  return (
    <Toolbar label={T.cage.tools} kind="reshape">
      {EDITS.map(([edit, icon, command, { [tools.element]: needed = Infinity }]) => (
        <IconButton
          key={edit}
          icon={icon}
          label={T.cage.edits[edit]}
          {...app.command(command)}
          disabled={selected.count < needed}
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
