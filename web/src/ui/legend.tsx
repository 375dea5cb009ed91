/** Legend of the colours in the view. */

import type { App } from "../app";
import type { SceneOptions } from "../contract";
import { scientific } from "../format";
import { T } from "../words";

export function LegendOfColours({ app }: { app: App }) {
  const { legend, scene, selected } = app.store.get();
  if (!legend) return null;
  const isKinds = legend.map === "kinds";
  const title = titleOf(scene, selected.last ?? 0);
  const [low = "", middle = "", high = ""] = isKinds
    ? T.legend.kinds
    : [scientific(legend.low), "", scientific(legend.high)];
  return (
    <figure class="floating legend" aria-label={T.legend.name(title, low, high)}>
      <figcaption>
        <strong>{title}</strong>
      </figcaption>
      <div class="ramp" data-map={legend.map} />
      <div class="row ends">
        <span>{low}</span>
        <span class="grow">{middle}</span>
        <span>{high}</span>
      </div>
      {legend.largest && <p>{T.legend.largest(legend.largest.value, legend.largest.vertex)}</p>}
    </figure>
  );
}

function titleOf(scene: SceneOptions, last: number): string {
  if (scene.slice === "kinds") return T.legend.cells;
  if (scene.slice === "value") return T.legend.coordinate(last);
  return scene.colour === "weight" ? T.legend.weight(last) : T.legend.error;
}
