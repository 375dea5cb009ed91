/** Step 1: the open model, opening of files, and samples. */

import { useState } from "preact/hooks";
import type { App } from "../app";
import type { ModelInfo, UpAxis } from "../contract";
import { asksToPull, isCapture } from "../derived";
import { count, scientific } from "../format";
import { sentence } from "../strings";
import { T } from "../words";
import { Button, Facts, Fold, Head, Say, Section, Segments } from "./controls";
import { Icon, type IconName } from "./icons";
import { Models } from "./models";
import { useTouch } from "./touch";

/** Icons that are shown until the picture of a sample is loaded. */
const ICONS: Record<string, IconName> = { rat: "spark", humanoid: "pose", clamp: "bind" };

export function ModelPanel({ app }: { app: App }) {
  const { model, sample, samples, works } = app.store.get();
  const isTouch = useTouch();
  const task = asksToPull(app.store.get()) ? T.samples[sample ?? ""]?.task : undefined;
  const open = model && (
    <>
      {model.members.length === 1 ? <ModelCard app={app} model={model} /> : <Up app={app} model={model} />}
      {!isCapture(model) && <Models app={app} model={model} />}
      {model.notices.map((notice) => (
        <Say key={notice} kind="hint" text={sentence(notice)} />
      ))}
    </>
  );
  return (
    <div class="stack loose">
      <Head title={task ?? T.model.title} sentence={isTouch ? T.model.sentenceTouch : T.model.sentence} />
      <div class="dropzone">
        <Icon name="upload" />
        <div class="grow">
          <strong data-tip={T.model.kinds}>{isTouch ? T.model.dropTouch : T.model.drop}</strong>
        </div>
        <div class="row wrap">
          {model && <Button label={T.panel.open} onClick={app.chooseModel} icon="file" />}
          <Button label={T.model.openFolder} onClick={app.chooseFolder} icon="open" />
        </div>
      </div>
      {works.length > 0 && (
        <div class="row">
          <Button
            label={T.model.kept(works.length)}
            onClick={() => app.store.set({ worksOpen: true })}
            icon="save"
          />
        </div>
      )}
      {sample === null && open}
      <Section title={T.model.samples}>
        <ul class="gallery">
          {samples.map((id) => (
            <SampleCard key={id} app={app} id={id} isOpen={id === sample} />
          ))}
        </ul>
        <p class="hint">
          <a href="./gallery.html" target="_blank" rel="noopener">
            {T.model.gallery}
          </a>
        </p>
      </Section>
      {sample !== null && open}
      <Privacy />
      <p class="hint">
        <a href="./licences.txt" target="_blank" rel="noopener">
          {T.model.licences}
        </a>
      </p>
    </div>
  );
}

function Up({ app, model }: { app: App; model: ModelInfo }) {
  return (
    <Segments<UpAxis>
      label={T.model.up}
      values={isCapture(model) ? ["y", "z", "y_down"] : ["y", "z"]}
      labels={{ y: "Y", z: "Z", y_down: "−Y" }}
      tips={{ y: T.model.upY, z: T.model.upZ, y_down: T.model.upYDown }}
      value={model.up}
      onChange={(axis) => void app.files.turn(axis)}
    />
  );
}

export function Privacy() {
  return (
    <p class="privacy">
      <Icon name="lock" />
      <span>{T.privacy}</span>
    </p>
  );
}

function SampleCard({ app, id, isOpen }: { app: App; id: string; isOpen: boolean }) {
  const [hasPicture, setHasPicture] = useState(true);
  const { name = id, tip } = T.samples[id] ?? {};
  return (
    <li>
      <button
        type="button"
        class="sample"
        data-sample={id}
        aria-current={isOpen ? "true" : undefined}
        data-tip={tip}
        onClick={() => void app.files.openSample(id)}
      >
        <span class="thumb">
          <Icon name={ICONS[id] ?? "model"} />
          {hasPicture && (
            <img
              src={`./samples/${id}.webp`}
              alt=""
              width="72"
              height="72"
              loading="lazy"
              onError={() => setHasPicture(false)}
            />
          )}
        </span>
        <span class="grow">
          <strong>{name}</strong>
        </span>
      </button>
    </li>
  );
}

function ModelCard({ app, model }: { app: App; model: ModelInfo }) {
  const { min, max } = model.bounds;
  const size = max.map((value, i) => scientific(value - (min[i] ?? 0))).join(" × ");
  const some = (n: number) => n > 0 && count(n);
  return (
    <section class="card stack tight" aria-label={T.model.isOpen}>
      <strong class="clip">{model.name}</strong>
      <p class="hint">
        {[
          model.splats > 0 && T.model.count.splats(model.splats),
          model.points > 0 && T.model.count.points(model.points),
          !isCapture(model) && T.model.count.vertices(model.vertices),
          alsoThere(model),
        ]
          .filter(Boolean)
          .join(", ")}
      </p>
      <Fold title={T.more}>
        <Up app={app} model={model} />
        <Facts
          rows={[
            [T.model.triangles, !isCapture(model) && some(model.triangles)],
            [T.model.size, size],
            [T.model.materials, some(model.materials)],
            [T.model.textures, some(model.textures)],
          ]}
        />
      </Fold>
    </section>
  );
}

function alsoThere({ joints, clips, targets }: ModelInfo): string {
  const parts = [
    joints > 0 && T.model.joints(joints),
    clips.length > 0 && T.model.clips(clips.length),
    targets.length > 0 && T.model.morphTargets(targets.length),
  ];
  return parts.filter(Boolean).join(", ");
}
