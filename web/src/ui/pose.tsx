/** Step 4: the selection and how it moves, saved poses, proportions, and pulling. */

import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import type { App } from "../app";
import type { PoseView } from "../contract";
import { SLIDERS } from "../defaults";
import { currentPose } from "../derived";
import { coordinate, percent } from "../format";
import { T } from "../words";
import {
  Button,
  Fold,
  fieldsOf,
  Head,
  IconButton,
  NumberInput,
  Section,
  Segments,
  SHARES,
  Slider,
  TextEntry,
  Toggle,
} from "./controls";
import { Icon } from "./icons";
import { Proportions } from "./proportions";
import { useTouch } from "./touch";

export function PosePanel({ app }: { app: App }) {
  const { posed } = app.store.get();
  return (
    <div class="stack loose">
      <Head title={T.pose.title} sentence={posed ? undefined : T.pose.sentence} />
      <Selection app={app} />
      <Section title={T.pose.poses}>
        <Poses app={app} />
      </Section>
      <Proportions app={app} />
      <More app={app} />
    </div>
  );
}

/** What is selected, where it is, and how gestures move it. */
function Selection({ app }: { app: App }) {
  const { model, selected, tools, unmatched } = app.store.get();
  const size = model ? Math.max(...model.bounds.max.map((high, i) => high - (model.bounds.min[i] ?? 0))) : 0;
  const { count, last, center } = selected;
  const option = fieldsOf(tools, app.view.tools);
  const isTouch = useTouch();
  const move = (index: number, value: number) => {
    const [x = 0, y = 0, z = 0] = (center ?? []).map((old, i) => (i === index ? value : old));
    if (center) app.edit.moveTo(x, y, z);
  };
  return (
    <div class="stack">
      <p class={count > 0 ? "selected" : "hint"}>{useSelectionText(app)}</p>
      {count > 0 && (
        <div class="axis-fields">
          {T.axes.map((axis, index) => (
            <div class="axis-field" data-axis={"xyz"[index]} key={axis}>
              <span aria-hidden="true">{axis}</span>
              <NumberInput
                name={T.pose.axis(axis)}
                value={coordinate(center?.[index] ?? 0, size)}
                onChange={(value) => move(index, value)}
              />
            </div>
          ))}
        </div>
      )}
      {count > 1 && (
        <Segments label={T.pose.pivot} labels={T.pose.pivots} tips={T.pose.pivotTips} {...option("pivot")} />
      )}
      <div class="row even">
        <Button
          icon="symmetry"
          label={T.pose.mirror}
          tip={T.pose.mirrorTip(app.key("symmetry"))}
          pressed={tools.symmetry}
          onClick={() => app.run("symmetry")}
        />
        <Button
          icon="proportional"
          label={T.pose.proportional}
          tip={isTouch ? T.pose.proportionalTouch : T.pose.proportionalTip(app.key("proportional"))}
          pressed={tools.proportionalOn}
          onClick={() => app.run("proportional")}
        />
      </div>
      {tools.proportionalOn && (
        <Slider
          label={T.pose.far}
          {...SLIDERS.proportional}
          format={(value) => T.pose.ofCage(percent(value))}
          {...option("proportional")}
        />
      )}
      {tools.symmetry && unmatched > 0 && (
        <p class="hint warn-text">
          {count === 1 && app.ctx.engine().movesAlone(last ?? 0)
            ? T.pose.movesAlone
            : T.pose.unmatched(unmatched)}
        </p>
      )}
    </div>
  );
}

/** Says what is selected, or how to select something. */
function useSelectionText(app: App): string {
  const { cage, selected, editingRest, scene } = app.store.get();
  const isTouch = useTouch();
  const { count, last } = selected;
  const inner = (last ?? 0) - (cage?.info.vertices ?? 0);
  if (count > 1) return T.pose.middle(count);
  if (count === 1 && inner >= 0) return T.pose.inner(inner + 1);
  if (count === 1) return editingRest ? T.pose.vertexAtRest(last ?? 0) : T.pose.vertex(last ?? 0);
  if (!scene.cage) return T.pose.noneHidden;
  return isTouch ? T.pose.noneTouch : T.pose.none;
}

/** The saved poses as a strip of pictures. */
function Poses({ app }: { app: App }) {
  const state = app.store.get();
  const { poses, posed, pictures, bound, bindRun, gesture, playing } = state;
  const others = poses.filter((pose) => !pose.fits).length;
  const list = useRef<HTMLUListElement>(null);
  const count = useRef(poses.length);
  const isMissing = poses.some(({ fits, hash }) => fits && !pictures[hash]);
  const current = currentPose(state);
  useEffect(() => {
    if (isMissing && bound && !bindRun && gesture === null && !playing) void app.poses.drawPictures();
  }, [app, isMissing, bound, bindRun, gesture, playing]);
  useLayoutEffect(() => {
    // A pose that was just saved is the last of the list, and the blend consists of it alone.
    const isSaved = poses.length === count.current + 1 && current === poses.length - 1;
    count.current = poses.length;
    if (isSaved) list.current?.lastElementChild?.scrollIntoView({ block: "nearest", inline: "nearest" });
  });
  return (
    <>
      {poses.length === 0 ? (
        <p class="hint">{T.pose.empty}</p>
      ) : (
        <ul class="poses" ref={list}>
          {poses.map((pose, index) =>
            pose.fits ? (
              <PoseCard key={index} app={app} pose={pose} index={index} isCurrent={index === current} />
            ) : null,
          )}
        </ul>
      )}
      {others > 0 && <p class="hint">{T.pose.waiting(others)}</p>}
      {posed && (
        <Button
          label={T.pose.reset}
          onClick={() => app.run("resetPose")}
          icon="reset"
          tip={T.pose.resetTip(app.key("resetPose"))}
        />
      )}
    </>
  );
}

const NAME_FIELD = { class: "pose-name", rows: 1, maxLength: 60 };

interface PoseCardProps {
  app: App;
  pose: PoseView;
  index: number;
  isCurrent: boolean;
}

/** Picture, name and share of a pose, and, for the pose that is shown, what can be done with it. */
function PoseCard({ app, pose, index, isCurrent }: PoseCardProps) {
  const { playingPose, pictures, shares, modified } = app.store.get();
  const { name, hash } = pose;
  const picture = pictures[hash];
  const share = shares[index] ?? 0;
  const isModified = isCurrent && modified;
  const onPose = (act: (index: number) => void) => () => {
    const place = app.poses.indexOf(pose, index);
    if (place !== undefined) act(place);
  };
  return (
    <li
      class={isCurrent ? "pose current" : "pose"}
      aria-current={playingPose === name ? "true" : undefined}
      onKeyDown={(event) => {
        const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
        if (!event.altKey || by === undefined) return;
        event.preventDefault();
        app.poses.move(index, index + by);
      }}
    >
      <button
        type="button"
        class="pose-picture"
        aria-label={T.pose.show(name)}
        aria-pressed={isCurrent}
        data-tip={T.pose.showTip(name, app.key("undo"))}
        onClick={onPose(app.poses.apply)}
      >
        {picture ? <img src={picture} alt="" width="112" height="84" /> : <Icon name="pose" />}
        {isModified && <span class="badge warn">{T.pose.modified}</span>}
      </button>
      {/* Unlike an input, a textarea wraps a long name. */}
      <TextEntry
        wraps
        name={T.pose.nameOf(name)}
        text={name}
        parse={String}
        onCommit={(text) => app.poses.rename(index, text)}
        attributes={NAME_FIELD}
      />
      <input
        {...{ min: SHARES.min, max: SHARES.max, step: SHARES.step }}
        type="range"
        value={share}
        aria-label={T.pose.blendOf(name)}
        aria-valuetext={percent(share)}
        data-tip={T.pose.blendTip}
        onInput={(event) => app.poses.blend(index, event.currentTarget.valueAsNumber, false)}
        onChange={(event) => app.poses.blend(index, event.currentTarget.valueAsNumber, true)}
      />
      {isCurrent && (
        <div class="row icons">
          <IconButton
            icon="save"
            label={T.pose.updateOf(name)}
            onClick={onPose(app.poses.update)}
            kind="small"
            disabled={!modified}
          />
          <IconButton
            icon="copy"
            label={T.pose.duplicate(name)}
            onClick={onPose(app.poses.duplicate)}
            kind="small"
          />
          <IconButton
            icon="trash"
            label={T.pose.delete(name)}
            onClick={onPose(app.poses.remove)}
            kind="small"
          />
        </div>
      )}
    </li>
  );
}

/** Options of pulling, morph targets, and clips of another rig. */
function More({ app }: { app: App }) {
  const { model, cage, pins, pullWhole, scene, walk, bound, clip } = app.store.get();
  const how = useTouch() ? T.pull.sentenceTouch : T.pull.sentence(app.key("pin"));
  const canWalk = model && cage && !model.rigged && model.clips.length === 0;
  return (
    <>
      {pins.length > 0 && (
        <div class="row">
          <span class="grow">{T.pull.pins(pins.length)}</span>
          <Button label={T.pull.unpinAll} onClick={app.pull.unpinAll} />
        </div>
      )}
      <Fold title={model?.targets.length ? T.pose.pullingAndTargets : T.pose.pulling}>
        <p class="hint">{scene.pull ? how : T.pull.off}</p>
        <Toggle
          label={T.pull.whole}
          sentence={T.pull.wholeSentence}
          value={pullWhole}
          onChange={app.pull.whole}
        />
        {canWalk && (
          <Button label={T.walk.open} tip={T.walk.sentence} disabled={!bound} onClick={app.chooseRig} />
        )}
        {walk && (
          <>
            <p class="hint">{T.walk.exported(walk.name)}</p>
            <Button label={T.walk.close} icon="close" onClick={() => app.walk.choose(null)} />
          </>
        )}
        {model?.targets.map(({ name, default: atRest }, k) => (
          <Slider
            key={k}
            label={name}
            {...SHARES}
            value={clip.targets[k] ?? atRest}
            onChange={(weight) => void app.clips.target(k, weight)}
          />
        ))}
      </Fold>
    </>
  );
}
