/** Options of the automatic cage. */

import type { App } from "../app";
import type { CageOptions } from "../contract";
import { SLIDERS } from "../defaults";
import { count, percent } from "../format";
import { T } from "../words";
import { Fold, fieldsOf, Segments, Select, SHARES, Slider, Toggle } from "./controls";

/**
 * Lowest value of the slider for voxels. It stands for `voxels: 0`, with which the number of vertices determines the
 * resolution.
 */
const MIN_VOXELS = SLIDERS.voxels.min;
/** Kinds that the panel offers; `hull` is a source of its own. */
const FOLLOWED = ["auto", "skeleton", "shell"] as const satisfies readonly CageOptions["kind"][];
/** Width below which gaps of the model are closed, voxels. */
const GAP_VOXELS = 3;

/** The slider for closeness is logarithmic in `detail`: 0 is the coarsest detail, 1 the finest. */
const { min: FINEST_DETAIL, max: COARSEST_DETAIL } = SLIDERS.detail;
const DETAIL_RATIO = COARSEST_DETAIL / FINEST_DETAIL;
const detailOf = (closeness: number) => COARSEST_DETAIL * DETAIL_RATIO ** -closeness;
const closenessOf = (detail: number) => Math.log(COARSEST_DETAIL / detail) / Math.log(DETAIL_RATIO);

export function Automatic({ app }: { app: App }) {
  const { cageOptions: options, model } = app.store.get();
  const named = [...new Set(model?.clips.map((clip) => clip.name))];
  const option = fieldsOf(options, (patch) =>
    app.store.set({ cageOptions: { ...app.store.get().cageOptions, ...patch } }),
  );
  const [detail, voxels] = [option("detail"), option("voxels")];
  return (
    <div class="stack">
      <Slider label={T.cage.wanted} {...SLIDERS.target} format={count} {...option("target")} />
      <Slider
        label={T.cage.closeness}
        {...SHARES}
        step={SLIDERS.detail.step}
        format={() => T.cage.within(percent(detail.value, 1))}
        value={closenessOf(detail.value)}
        onChange={(closeness) => detail.onChange(detailOf(closeness))}
      />
      <Fold title={T.more}>
        <Segments
          label={T.cage.follow}
          labels={T.cage.follows}
          tips={T.cage.followTips}
          {...option("kind")}
          values={FOLLOWED}
        />
        <Toggle label={T.cage.quads} sentence={T.cage.quadsSentence} {...option("quads")} />
        <Segments label={T.cage.symmetry} labels={T.cage.symmetries} {...option("symmetry")} />
        <Slider
          label={T.cage.margin}
          {...SLIDERS.clearance}
          format={(value) => (value === 0 ? T.cage.tight : T.cage.ofSize(percent(value, 1)))}
          {...option("clearance")}
        />
        <Slider
          label={T.cage.gaps}
          {...SLIDERS.voxels}
          format={(value) =>
            value === MIN_VOXELS ? T.cage.asVertices : T.cage.from(percent(GAP_VOXELS / value, 1))
          }
          value={voxels.value || MIN_VOXELS}
          onChange={(value) => voxels.onChange(value === MIN_VOXELS ? 0 : value)}
        />
        {named.length > 0 && (
          <Select
            label={T.cage.around}
            none={T.cage.aroundRest}
            options={named.map((name) => [name, name])}
            {...fieldsOf(app.store.get(), app.store.set)("cageClip")}
          />
        )}
        <Toggle label={T.cage.perPart} sentence={T.cage.perPartSentence} {...option("per_component")} />
      </Fold>
    </div>
  );
}
