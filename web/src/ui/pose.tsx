/** Step 4: position of the selection, move options, and saved poses. */

import type { App } from "../app";
import type { Pivot } from "../contract";
import { fittingPoses } from "../derived";
import { coordinate, percent } from "../format";
import { T } from "../words";
import { Clips } from "./clips";
import { Button, Head, IconButton, NumberInput, Section, Segments, Slider, Toggle } from "./controls";
import { Icon } from "./icons";
import { useTouch } from "./touch";

const PIVOTS = ["middle", "border", "last"] as const satisfies readonly Pivot[];

export function PosePanel({ app }: { app: App }) {
  const { model } = app.store.get();
  return (
    <div class="stack loose">
      <Head title={T.pose.title} sentence={T.pose.sentence} />
      {model && (model.clips.length > 0 || model.rigged) && (
        <Section title={T.clips.title}>
          <Clips app={app} />
        </Section>
      )}
      <Section title={T.pull.title}>
        <PullOptions app={app} />
      </Section>
      <Section title={T.pose.cage}>
        <Selection app={app} />
      </Section>
      <Section title={T.pose.help}>
        <Help app={app} />
      </Section>
      <Section title={T.pose.poses}>
        <Poses app={app} />
      </Section>
    </div>
  );
}

function PullOptions({ app }: { app: App }) {
  const { pins, pullWhole, scene } = app.store.get();
  const how = useTouch() ? T.pull.sentenceTouch : T.pull.sentence(app.key("pin"));
  const sentence = scene.pull ? how : T.pull.off;
  return (
    <div class="stack">
      <p class="hint">{sentence}</p>
      <Toggle label={T.pull.whole} sentence={T.pull.wholeSentence} on={pullWhole} onChange={app.pull.whole} />
      {pins.length > 0 && (
        <div class="row">
          <span class="grow">{T.pull.pins(pins.length)}</span>
          <Button label={T.pull.unpinAll} onClick={app.pull.unpinAll} kind="small" />
        </div>
      )}
    </div>
  );
}

/** Position of the selection in number fields. */
function Selection({ app }: { app: App }) {
  const { model, cage, selected, editingRest, pivot, scene } = app.store.get();
  const size = model ? Math.max(...model.bounds.max.map((high, i) => high - (model.bounds.min[i] ?? 0))) : 0;
  const { count, last, center } = selected;
  const inner = (last ?? 0) - (cage?.info.vertices ?? 0);
  const how = useTouch() ? T.pose.noneTouch : T.pose.none;
  const none = scene.cage ? how : T.pose.noneHidden;
  const one = editingRest ? T.pose.vertexAtRest : T.pose.vertex;
  const move = (index: number, value: number) => {
    const [x = 0, y = 0, z = 0] = (center ?? []).map((old, i) => (i === index ? value : old));
    if (center) app.edit.moveTo(x, y, z);
  };
  return (
    <div class="stack">
      <p class="hint">
        {count === 0
          ? none
          : count === 1
            ? inner < 0
              ? one(last ?? 0)
              : T.pose.inner(inner + 1)
            : T.pose.middle(count)}
      </p>
      {count > 1 && (
        <Segments<Pivot>
          label={T.pose.pivot}
          choices={PIVOTS.map((value) => ({
            value,
            label: T.pose.pivots[value],
            tip: T.pose.pivotTips[value],
          }))}
          value={pivot}
          onChange={(value) => app.view.pivot(value)}
        />
      )}
      {count > 0 && (
        <div class="axis-fields">
          {T.axes.map((axis, index) => (
            <div class="axis-field" data-axis={"xyz"[index]} key={axis}>
              <span aria-hidden="true">{axis}</span>
              <NumberInput
                name={T.pose.axis(axis)}
                value={coordinate(center?.[index] ?? 0, size)}
                onCommit={(value) => move(index, value)}
              />
            </div>
          ))}
        </div>
      )}
    </div>
  );
}

function Help({ app }: { app: App }) {
  const { symmetry, unmatched, proportionalOn, proportional } = app.store.get();
  const isTouch = useTouch();
  return (
    <>
      <Toggle
        label={T.pose.mirror}
        sentence={T.pose.mirrorSentence}
        on={symmetry}
        onChange={(on) => app.view.symmetry(on)}
      />
      {symmetry && unmatched > 0 && <p class="hint warn-text">{T.pose.unmatched(unmatched)}</p>}
      <Toggle
        label={T.pose.proportional}
        sentence={isTouch ? T.pose.proportionalTouch : T.pose.proportionalSentence}
        on={proportionalOn}
        onChange={(on) => app.view.proportional(on)}
      />
      {proportionalOn && (
        <Slider
          label={T.pose.far}
          min={0.02}
          max={1}
          step={0.01}
          format={(value) => T.pose.ofCage(percent(value))}
          value={proportional}
          onInput={(value) => app.view.proportional(true, value)}
        />
      )}
    </>
  );
}

function Poses({ app }: { app: App }) {
  const state = app.store.get();
  const { poses, shares, playing, posed } = state;
  const fitting = fittingPoses(state);
  const others = poses.length - fitting.length;
  return (
    <>
      {poses.length === 0 && (
        <div class="empty-state">
          <Icon name="pose" />
          <p>{T.pose.empty}</p>
          <Button label={T.pose.save} onClick={() => app.run("savePose")} icon="plus" kind="small" />
        </div>
      )}
      <ul class="poses">
        {poses.map(
          ({ name, fits }, index) =>
            fits && <PoseRow key={index} app={app} index={index} name={name} share={shares[index] ?? 0} />,
        )}
      </ul>
      {others > 0 && <p class="hint">{T.pose.waiting(others)}</p>}
      <div class="row">
        <Button
          label={playing ? T.pose.stop : T.pose.play}
          onClick={() => app.run("play")}
          icon={playing ? "stop" : "play"}
          kind="small"
          disabled={fitting.length === 0}
        />
        <Button
          label={T.pose.reset}
          onClick={() => app.run("resetPose")}
          icon="reset"
          kind="small"
          tip={T.pose.resetTip(app.key("resetPose"))}
          disabled={!posed}
        />
      </div>
    </>
  );
}

function PoseRow(props: { app: App; index: number; name: string; share: number }) {
  const { app, index, name, share } = props;
  const isOn = app.store.get().playingPose === name;
  return (
    <li class="card pose" aria-current={isOn ? "true" : undefined}>
      <div class="row">
        <input
          class="pose-name"
          type="text"
          value={name}
          aria-label={T.pose.nameOf(name)}
          maxLength={60}
          onChange={(event) => app.poses.rename(index, event.currentTarget.value)}
        />
        <Button
          label={T.pose.show}
          onClick={() => app.poses.apply(index)}
          kind="small"
          tip={T.pose.showTip(name, app.key("undo"))}
        />
        <IconButton
          icon="trash"
          label={T.pose.delete(name)}
          onClick={() => app.poses.remove(index)}
          kind="small"
        />
      </div>
      <Slider
        label={T.pose.blend}
        name={T.pose.blendOf(name)}
        min={0}
        max={1}
        step={0.01}
        format={percent}
        value={share}
        onInput={(value) => app.poses.blend(index, value, false)}
        onCommit={(value) => app.poses.blend(index, value, true)}
      />
    </li>
  );
}
