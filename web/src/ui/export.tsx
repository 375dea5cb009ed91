/** Step 5: files to download. */

import type { ExportKind } from "../actions/exports";
import type { App } from "../app";
import type { ModelInfo } from "../contract";
import {
  animationName,
  fittingPoses,
  hasAnimation,
  isCapture,
  rigOf,
  shapeFormatOf,
  shapeFormatsOf,
} from "../derived";
import type { AppState } from "../state";
import { sentence } from "../strings";
import { T } from "../words";
import { RigChoices } from "./clips";
import { Fold, fieldsOf, Head, Segments, Select, Toggle } from "./controls";
import { Icon, type IconName } from "./icons";
import { Privacy } from "./model";

const ITEMS: readonly (readonly [ExportKind, IconName])[] = [
  ["glb", "model"],
  ["shape", "shape"],
  ["picture", "image"],
  ["project", "save"],
];
/** For a capture, a file of its own format comes first. */
const CAPTURE_ITEMS: typeof ITEMS = [
  ["shape", "shape"],
  ["picture", "image"],
  ["project", "save"],
  ["glb", "model"],
];
/** Exports that most people never use. */
const MORE_ITEMS: readonly (readonly [ExportKind, IconName])[] = [
  ["poses", "layers"],
  ["clips", "play"],
  ["cage", "cage"],
  ["controls", "bone"],
  ["weights", "table"],
];

/** Says why a file cannot be exported yet; null if it can. */
function missing(kind: ExportKind, state: AppState): string | null {
  const { bindFirst, cageFirst, poseFirst, modelFirst } = T.exports;
  if (kind === "picture") return state.model ? null : modelFirst;
  if (kind === "cage" || kind === "controls" || kind === "project") return state.cage ? null : cageFirst;
  if (!state.bound) return bindFirst;
  return kind === "poses" && fittingPoses(state).length === 0 ? poseFirst : null;
}

export function ExportPanel({ app }: { app: App }) {
  const { cage, model } = app.store.get();
  const isThere = (kind: ExportKind) => {
    if (kind === "controls") return (cage?.controls.inner ?? 0) > 0;
    if (kind === "glb" && model?.points) return false;
    if (kind === "clips") return (model?.joints ?? 0) > 0;
    return !isCapture(model) || (kind !== "poses" && kind !== "weights");
  };
  const list = (items: typeof ITEMS) => (
    <ul class="stack">
      {items
        .filter(([kind]) => isThere(kind))
        .map(([kind, icon]) => (
          <Item key={kind} app={app} kind={kind} icon={icon} />
        ))}
    </ul>
  );
  return (
    <div class="stack loose">
      <Head title={T.exports.title} />
      <Which app={app} />
      {list(isCapture(model) ? CAPTURE_ITEMS : ITEMS)}
      <Fold title={T.exports.more}>{list(MORE_ITEMS)}</Fold>
      <Privacy />
    </div>
  );
}

function Item({ app, kind, icon }: { app: App; kind: ExportKind; icon: IconName }) {
  const state = app.store.get();
  const [title = "", sentence = ""] = wordsOf(kind, state.model);
  const reason = missing(kind, state);
  const n = kind === "poses" ? fittingPoses(state).length : 0;
  return (
    <li>
      <button
        type="button"
        class="export-card"
        data-kind={kind}
        disabled={reason !== null}
        data-tip={reason ?? (n > 0 ? T.exports.poses(n, sentence) : sentence)}
        onClick={() => (kind === "clips" ? app.chooseClips() : void app.exports.save(kind))}
      >
        <span class="tile">
          <Icon name={icon} />
        </span>
        <span class="grow">
          <strong>{title}</strong>
          {reason && <span class="hint">{reason}</span>}
        </span>
        <Icon name="download" />
      </button>
      {kind === "picture" && <PictureOptions app={app} />}
      {kind === "glb" && <RigExport app={app} />}
      {kind === "poses" && state.model?.vrm && (
        <div class="export-option">
          <Toggle
            label={T.exports.expressions}
            sentence={T.exports.expressionsSentence}
            {...fieldsOf(state.rigOptions, app.clips.rig)("expressions")}
          />
        </div>
      )}
      {kind === "shape" && <ShapeFormat app={app} />}
    </li>
  );
}

/** Selection of the models to export: one of them, all as separate files, or all in an archive. */
function Which({ app }: { app: App }) {
  const members = app.store.get().model?.members ?? [];
  if (members.length < 2) return null;
  return (
    <Select<number | "zip">
      label={T.exports.which}
      none={T.exports.all(members.length)}
      options={[
        ["zip", T.exports.zip(members.length)],
        ...members.map(({ id, name }) => [id, name] as const),
      ]}
      {...fieldsOf(app.store.get(), app.store.set)("exportOnly")}
    />
  );
}

/** Options for the animation, skeleton, morph targets and clips of the exported GLB. */
function RigExport({ app }: { app: App }) {
  const state = app.store.get();
  const { model, clip } = state;
  const isAnimated = hasAnimation(state);
  if (!model?.rigged && !isAnimated) return null;
  return (
    <div class="export-option stack tight">
      {rigOf(state).dynamic && <p class="hint">{T.clips.baked(model?.clips[clip.clip ?? 0]?.name ?? "")}</p>}
      {isAnimated && (
        <Toggle
          label={T.timeline.include}
          sentence={T.timeline.includeSentence(fittingPoses(state).length, animationName(state))}
          {...fieldsOf(state, app.store.set)("withAnimation")}
        />
      )}
      <RigChoices app={app} />
    </div>
  );
}

function wordsOf(kind: ExportKind, model: ModelInfo | null): readonly string[] {
  if (kind === "shape" && model?.splats) return T.exports.splats;
  return kind === "shape" && model?.points ? T.exports.points : T.exports.items[kind];
}

function ShapeFormat({ app }: { app: App }) {
  const state = app.store.get();
  const { onChange } = fieldsOf(state, app.store.set)("shapeFormat");
  const format = shapeFormatOf(state);
  return (
    <div class="export-option stack tight">
      {state.clip.clip !== null && (
        <Segments
          label={T.exports.moment}
          labels={{ frame: T.exports.frame, rest: T.exports.restShape }}
          {...fieldsOf(state, app.store.set)("shapeMoment")}
        />
      )}
      <Segments
        label={T.exports.format}
        values={shapeFormatsOf(state.model)}
        labels={(format) => format.toUpperCase()}
        value={format}
        onChange={onChange}
      />
      {app.ctx
        .engine()
        .lostIn(format)
        .map((lost) => (
          <p key={lost} class="hint" lang="en">
            {sentence(lost)}
          </p>
        ))}
    </div>
  );
}

function PictureOptions({ app }: { app: App }) {
  const option = fieldsOf(app.store.get(), app.store.set);
  return (
    <div class="export-option stack tight">
      <Segments
        label={T.exports.size}
        values={[1, 2, 4]}
        labels={T.exports.sizes}
        {...option("pictureScale")}
      />
      <Toggle label={T.exports.alone} sentence={T.exports.aloneSentence} {...option("pictureAlone")} />
    </div>
  );
}
