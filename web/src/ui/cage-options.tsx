/** Options of the automatic cage. */

import type { App } from "../app";
import type { CageOptions } from "../contract";
import { FINEST_DETAIL, RANGES } from "../defaults";
import { count, percent } from "../format";
import { T } from "../words";
import { Segments, Slider, Toggle } from "./controls";

/** Lowest position of the voxel slider. It stands for 0: the vertex count determines the resolution. */
const COARSEST = 16;
/** Gaps narrower than this many voxels are closed. */
const GAP_VOXELS = 3;

/** The slider of closeness is logarithmic: 0 is four times the default distance, 1 a quarter of it. */
const FINER = 16;
const COARSEST_DETAIL = FINEST_DETAIL * FINER;
const detailOf = (closeness: number) => COARSEST_DETAIL * FINER ** -closeness;
const closenessOf = (detail: number) => Math.log(COARSEST_DETAIL / detail) / Math.log(FINER);

export function Automatic({ app }: { app: App }) {
  const { cageOptions: options, cageClip, model } = app.store.get();
  const named = [...new Set(model?.clips.map((clip) => clip.name))];
  const change = (patch: Partial<CageOptions>) =>
    app.store.set({ cageOptions: { ...app.store.get().cageOptions, ...patch } });
  return (
    <div class="stack">
      <Slider
        label={T.cage.wanted}
        min={RANGES.vertices[0]}
        max={RANGES.vertices[1]}
        step={2}
        format={count}
        value={options.vertices}
        onInput={(vertices) => change({ vertices })}
      />
      <Slider
        label={T.cage.closeness}
        min={0}
        max={1}
        step={0.05}
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
        choices={(["auto", "on", "off"] as const).map((value) => ({
          value,
          label: T.cage.symmetries[value],
        }))}
        value={options.symmetry}
        onChange={(symmetry) => change({ symmetry })}
      />
      <Slider
        label={T.cage.margin}
        min={0}
        max={0.15}
        step={0.005}
        format={(value) => (value === 0 ? T.cage.tight : T.cage.ofSize(percent(value, 1)))}
        value={options.margin}
        onInput={(margin) => change({ margin })}
      />
      <Slider
        label={T.cage.gaps}
        min={COARSEST}
        max={RANGES.voxels[1]}
        step={8}
        format={(value) =>
          value === COARSEST ? T.cage.asVertices : T.cage.from(percent(GAP_VOXELS / value, 1))
        }
        value={options.voxels || COARSEST}
        onInput={(voxels) => change({ voxels: voxels === COARSEST ? 0 : voxels })}
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
