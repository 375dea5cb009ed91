/** Step 5: files to download. */

import { useEffect, useState } from "preact/hooks";
import type { ExportKind, ShapeFormatName } from "../actions/exports";
import type { App } from "../app";
import { SHAPE_FORMATS } from "../defaults";
import { fittingPoses, rigOf } from "../derived";
import type { AppState } from "../state";
import { T } from "../words";
import { RigChoices } from "./clips";
import { Head, Segments, Toggle } from "./controls";
import { Icon, type IconName } from "./icons";
import { Privacy } from "./model";

const ITEMS: readonly (readonly [ExportKind, IconName])[] = [
  ["glb", "model"],
  ["shape", "shape"],
  ["poses", "layers"],
  ["cage", "cage"],
  ["controls", "bone"],
  ["weights", "table"],
  ["picture", "image"],
  ["project", "save"],
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
  const hasInside = (app.store.get().cage?.controls.inner ?? 0) > 0;
  return (
    <div class="stack loose">
      <Head title={T.exports.title} sentence={T.exports.sentence} />
      <Which app={app} />
      <ul class="stack">
        {ITEMS.filter(([kind]) => kind !== "controls" || hasInside).map(([kind, icon]) => (
          <Item key={kind} app={app} kind={kind} icon={icon} />
        ))}
      </ul>
      <Privacy />
    </div>
  );
}

function Item({ app, kind, icon }: { app: App; kind: ExportKind; icon: IconName }) {
  const state = app.store.get();
  const [title = "", sentence = ""] = T.exports.items[kind];
  const reason = missing(kind, state);
  const n = kind === "poses" ? fittingPoses(state).length : 0;
  return (
    <li>
      <button
        type="button"
        class="export-card"
        data-kind={kind}
        disabled={reason !== null}
        onClick={() => void app.exports.save(kind)}
      >
        <span class="tile">
          <Icon name={icon} />
        </span>
        <span class="grow">
          <strong>{title}</strong>
          <span class="hint">{reason ?? (n > 0 ? T.exports.poses(n, sentence) : sentence)}</span>
        </span>
        <Icon name="download" />
      </button>
      {kind === "picture" && <PictureOptions app={app} />}
      {kind === "glb" && <RigExport app={app} />}
      {kind === "shape" && <ShapeFormat app={app} />}
    </li>
  );
}

/** List to choose which model to export, or all of them. */
function Which({ app }: { app: App }) {
  const { model, exportOnly } = app.store.get();
  const members = model?.members ?? [];
  if (members.length < 2) return null;
  const which = exportOnly === "zip" ? "zip" : (members.find(({ id }) => id === exportOnly)?.id ?? "");
  const choose = (chosen: string) => {
    const exportOnly = chosen === "zip" ? "zip" : chosen === "" ? null : Number(chosen);
    app.store.set({ exportOnly });
  };
  return (
    <label class="stack tight">
      <span class="legend-text">{T.exports.which}</span>
      <select value={which} onChange={({ currentTarget: { value } }) => choose(value)}>
        <option value="">{T.exports.all(members.length)}</option>
        <option value="zip">{T.exports.zip(members.length)}</option>
        {members.map(({ id, name }) => (
          <option key={id} value={id}>
            {name}
          </option>
        ))}
      </select>
    </label>
  );
}

/** Options for the skeleton, morph targets and clips of the exported GLB. */
function RigExport({ app }: { app: App }) {
  const { model, rigOptions, clip } = app.store.get();
  if (rigOf(app.store.get()).dynamic)
    return <p class="export-option hint">{T.clips.baked(model?.clips[clip.clip ?? 0]?.name ?? "")}</p>;
  if (!model?.rigged) return null;
  return (
    <div class="export-option stack tight">
      <Toggle
        label={T.clips.keep}
        sentence={T.clips.keepSentence(model.joints, model.targets.length, model.clips.length)}
        on={!rigOptions.plain}
        onChange={(on) => app.clips.rig({ plain: !on })}
      />
      {!rigOptions.plain && <RigChoices app={app} />}
    </div>
  );
}

function ShapeFormat({ app }: { app: App }) {
  const [format, setFormat] = useState<ShapeFormatName>(SHAPE_FORMATS[0]);
  const [moment, setMoment] = useState<"frame" | "rest">("frame");
  useEffect(() => app.exports.shapeIn(format, moment === "frame"), [app, format, moment]);
  const isClipShown = app.store.get().clip.clip !== null;
  return (
    <div class="export-option stack tight">
      {isClipShown && (
        <Segments
          label={T.exports.moment}
          choices={[
            { value: "frame", label: T.exports.frame },
            { value: "rest", label: T.exports.restShape },
          ]}
          value={moment}
          onChange={setMoment}
        />
      )}
      <Segments
        label={T.exports.format}
        choices={SHAPE_FORMATS.map((value) => ({ value, label: value.toUpperCase() }))}
        value={format}
        onChange={setFormat}
      />
    </div>
  );
}

function PictureOptions({ app }: { app: App }) {
  const [size, setSize] = useState("2");
  const [alone, setAlone] = useState(false);
  useEffect(() => app.exports.pictureOf(Number(size), alone), [app, size, alone]);
  return (
    <div class="export-option stack tight">
      <Segments
        label={T.exports.size}
        choices={["1", "2", "4"].map((value, k) => ({ value, label: T.exports.sizes[k] ?? value }))}
        value={size}
        onChange={setSize}
      />
      <Toggle label={T.exports.alone} sentence={T.exports.aloneSentence} on={alone} onChange={setAlone} />
    </div>
  );
}
