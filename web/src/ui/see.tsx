/** The See panel: colours, wireframes, grid slice, and coordinates side by side. */

import { isComparison } from "../actions/view";
import type { App } from "../app";
import type { Coordinates } from "../contract";
import { COORDINATES } from "../defaults";
import { isCapture } from "../derived";
import { T } from "../words";
import { fieldsOf, IconButton, Section, Segments, SHARES, Slider, switchOf, Toggle } from "./controls";

export function See({ app }: { app: App }) {
  if (!app.store.get().seeOpen) return null;
  return (
    <aside class="see" id="see" aria-label={T.see.title}>
      <div class="row see-head">
        <h2 class="grow">{T.see.title}</h2>
        <IconButton icon="close" label={T.see.close} kind="small" {...app.command("see")} />
      </div>
      <div class="see-body stack loose">
        <Colours app={app} />
        <Section title={T.see.grid}>
          <Grid app={app} />
        </Section>
        <Section title={T.see.show}>
          <Parts app={app} />
        </Section>
      </div>
    </aside>
  );
}

function Colours({ app }: { app: App }) {
  const { scene, selected, bound, model } = app.store.get();
  const needsVertex = scene.colour === "weight" && selected.last === null;
  const option = fieldsOf(scene, app.view.scene);
  return (
    <div class="stack">
      <Segments
        label={T.see.colour}
        labels={T.see.colours}
        tips={T.see.about}
        disabled={bound ? [] : ["weight", "error"]}
        {...option("colour")}
      />
      {needsVertex && <p class="hint">{T.see.selectForWeights}</p>}
      {scene.colour === "weight" && (
        <Toggle label={T.see.toOne} sentence={T.see.toOneSentence} {...option("weights_to_one")} />
      )}
      {!isCapture(model) && <Comparison app={app} />}
    </div>
  );
}

/** Check boxes that choose which coordinates are shown side by side. */
export function Comparison({ app }: { app: App }) {
  const { compare } = app.store.get().scene;
  const without = (kind: Coordinates) => compare.filter((other) => other !== kind);
  const toggled = (kind: Coordinates) =>
    COORDINATES.filter((other) => (other === kind) !== compare.includes(other));
  return (
    <fieldset class="field">
      <legend class="legend-text" data-tip={T.see.compareSentence}>
        {T.see.compare}
      </legend>
      <div class="segments">
        {COORDINATES.map((kind) => (
          <label key={kind}>
            <input
              type="checkbox"
              checked={compare.includes(kind)}
              // Do not allow a single kind other than harmonic, because gestures act on the harmonic shape.
              disabled={
                compare.includes(kind) && String(without(kind)) !== "harmonic" && !isComparison(without(kind))
              }
              onChange={() => void app.view.compare(toggled(kind))}
            />
            <span>{T.coordinates[kind]}</span>
          </label>
        ))}
      </div>
    </fieldset>
  );
}

function Grid({ app }: { app: App }) {
  const { scene, slice, selected } = app.store.get();
  const { cells, coordinate, selectForCoordinate } = T.see;
  const about =
    scene.slice !== "value"
      ? cells
      : selected.last === null
        ? selectForCoordinate
        : coordinate(selected.last);
  return (
    <>
      <Segments
        label={T.see.slice}
        labels={T.see.slices}
        value={scene.slice}
        onChange={(kind) => app.view.slice({}, kind)}
      />
      {scene.slice !== "off" && (
        <div class="stack" data-busy={slice.busy ? "" : undefined}>
          <Segments
            label={T.see.across}
            values={[0, 1, 2]}
            labels={(axis) => T.axes[axis] ?? ""}
            {...fieldsOf(slice, app.view.slice)("axis")}
          />
          <SlicePosition app={app} />
          <p class="hint">{about}</p>
        </div>
      )}
    </>
  );
}

export function SlicePosition({ app }: { app: App }) {
  const field = fieldsOf(app.store.get().slice, app.view.slice);
  return <Slider label={T.see.where} {...SHARES} step={0.005} {...field("position")} />;
}

function Parts({ app }: { app: App }) {
  const option = fieldsOf(app.store.get().scene, app.view.scene);
  const parts = Object.keys(T.see.parts) as (keyof typeof T.see.parts)[];
  const joints = switchOf(option("joints"), "follow", null);
  return (
    <div class="stack tight">
      {parts.map((part) => {
        const [label = "", sentence = ""] = T.see.parts[part];
        return <Toggle key={part} label={label} sentence={sentence} {...option(part)} />;
      })}
      {(app.store.get().model?.joints ?? 0) > 0 && (
        <Toggle label={T.clips.joints} sentence={T.clips.jointsSentence} {...joints} />
      )}
      <Floaters app={app} />
    </div>
  );
}

/** Shows or hides the splats outside the cage. */
function Floaters({ app }: { app: App }) {
  const { scene, floaters } = app.store.get();
  if (floaters === 0) return null;
  const [label, sentence] = T.see.floaters(floaters);
  return <Toggle label={label} sentence={sentence} {...fieldsOf(scene, app.view.scene)("floaters")} />;
}
