/** Options of the automatic cage. */

import type { App } from "../app";
import type { CageOptions } from "../contract";
import { SLIDERS } from "../defaults";
import { count, percent } from "../format";
import { T } from "../words";
import { choicesOf, Segments, Slider, Toggle } from "./controls";

/**
 * Lowest value of the slider for voxels. It stands for `voxels: 0`, with which the number of vertices determines the
 * resolution.
 */
const MIN_VOXELS = SLIDERS.voxels.min;
/** Width below which gaps of the model are closed, voxels. */
const GAP_VOXELS = 3;

/** The slider for closeness is logarithmic in `detail`: 0 is the coarsest detail, 1 the finest. */
const { min: FINEST_DETAIL, max: COARSEST_DETAIL } = SLIDERS.detail;
const DETAIL_RATIO = COARSEST_DETAIL / FINEST_DETAIL;
const detailOf = (closeness: number) => COARSEST_DETAIL * DETAIL_RATIO ** -closeness;
const closenessOf = (detail: number) => Math.log(COARSEST_DETAIL / detail) / Math.log(DETAIL_RATIO);

export function Automatic({ app }: { app: App }) {
  const { cageOptions: options, cageClip, model } = app.store.get();
  const named = [...new Set(model?.clips.map((clip) => clip.name))];
  const change = (patch: Partial<CageOptions>) =>
    app.store.set({ cageOptions: { ...app.store.get().cageOptions, ...patch } });
  return (
    <div class="stack">
      <Slider
        label={T.cage.wanted}
        {...SLIDERS.target}
        format={count}
        value={options.target}
        onInput={(target) => change({ target })}
      />
      <Slider
        label={T.cage.closeness}
        min={0}
        max={1}
        step={SLIDERS.detail.step}
        format={() => T.cage.within(percent(options.detail, 1))}
        value={closenessOf(options.detail)}
        onInput={(closeness) => change({ detail: detailOf(closeness) })}
      />
      <Toggle
        label={T.cage.quads}
        sentence={T.cage.quadsSentence}
        on={options.quads}
        onChange={(on) => change({ quads: on })}
      />
      <Segments<CageOptions["symmetry"]>
        label={T.cage.symmetry}
        choices={choicesOf(["auto", "x", "none"], T.cage.symmetries)}
        value={options.symmetry}
        onChange={(symmetry) => change({ symmetry })}
      />
      <Slider
        label={T.cage.margin}
        {...SLIDERS.clearance}
        format={(value) => (value === 0 ? T.cage.tight : T.cage.ofSize(percent(value, 1)))}
        value={options.clearance}
        onInput={(clearance) => change({ clearance })}
      />
      <Slider
        label={T.cage.gaps}
        {...SLIDERS.voxels}
        format={(value) =>
          value === MIN_VOXELS ? T.cage.asVertices : T.cage.from(percent(GAP_VOXELS / value, 1))
        }
        value={options.voxels || MIN_VOXELS}
        onInput={(voxels) => change({ voxels: voxels === MIN_VOXELS ? 0 : voxels })}
      />
      {named.length > 0 && (
        <label class="stack tight">
          <span>{T.cage.around}</span>
          <select
            value={cageClip ?? ""}
            onChange={({ currentTarget: { value } }) => app.store.set({ cageClip: value || null })}
          >
            <option value="">{T.cage.aroundRest}</option>
            {named.map((name) => (
              <option key={name} value={name}>
                {name}
              </option>
            ))}
          </select>
        </label>
      )}
      <Toggle
        label={T.cage.perPart}
        sentence={T.cage.perPartSentence}
        on={options.per_component}
        onChange={(on) => change({ per_component: on })}
      />
    </div>
  );
}
