/** Step 4: position of the selection, move options, and saved poses. */

import { useLayoutEffect, useRef, useState } from "preact/hooks";
import type { App } from "../app";
import type { Interpolation, PoseView } from "../contract";
import { SLIDERS } from "../defaults";
import { fittingPoses } from "../derived";
import { coordinate, percent } from "../format";
import { T } from "../words";
import { Clips } from "./clips";
import {
  Button,
  fieldsOf,
  Head,
  IconButton,
  NumberField,
  NumberInput,
  Section,
  Segments,
  Select,
  SHARES,
  Slider,
  TextEntry,
  Toggle,
} from "./controls";
import { Icon } from "./icons";
import { Proportions } from "./proportions";
import { useTouch } from "./touch";
import { Walk } from "./walk";

const INTERPOLATIONS = ["step", "linear", "cubic"] as const satisfies readonly Interpolation[];

export function PosePanel({ app }: { app: App }) {
  const { model } = app.store.get();
  return (
    <div class="stack loose">
      <Head title={T.pose.title} sentence={T.pose.sentence} />
      <Proportions app={app} />
      <Section title={T.pose.poses}>
        <Poses app={app} />
      </Section>
      {model && (model.clips.length > 0 || model.rigged) && (
        <Section title={T.clips.title}>
          <Clips app={app} />
        </Section>
      )}
      <Walk app={app} />
      <Section title={T.pull.title}>
        <PullOptions app={app} />
      </Section>
      <Section title={T.pose.cage}>
        <Selection app={app} />
      </Section>
      <Section title={T.pose.help}>
        <Help app={app} />
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
      <Toggle
        label={T.pull.whole}
        sentence={T.pull.wholeSentence}
        value={pullWhole}
        onChange={app.pull.whole}
      />
      {pins.length > 0 && (
        <div class="row">
          <span class="grow">{T.pull.pins(pins.length)}</span>
          <Button label={T.pull.unpinAll} onClick={app.pull.unpinAll} />
        </div>
      )}
    </div>
  );
}

/** Position of the selection in number fields. */
function Selection({ app }: { app: App }) {
  const { model, cage, selected, editingRest, tools, scene } = app.store.get();
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
        <Segments
          label={T.pose.pivot}
          labels={T.pose.pivots}
          tips={T.pose.pivotTips}
          {...fieldsOf(tools, app.view.tools)("pivot")}
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
                onChange={(value) => move(index, value)}
              />
            </div>
          ))}
        </div>
      )}
    </div>
  );
}

function Help({ app }: { app: App }) {
  const { tools, unmatched } = app.store.get();
  const option = fieldsOf(tools, app.view.tools);
  const isTouch = useTouch();
  return (
    <>
      <Toggle label={T.pose.mirror} sentence={T.pose.mirrorSentence} {...option("symmetry")} />
      {tools.symmetry && unmatched > 0 && <p class="hint warn-text">{T.pose.unmatched(unmatched)}</p>}
      <Toggle
        label={T.pose.proportional}
        sentence={isTouch ? T.pose.proportionalTouch : T.pose.proportionalSentence}
        {...option("proportionalOn")}
      />
      {tools.proportionalOn && (
        <Slider
          label={T.pose.far}
          {...SLIDERS.proportional}
          format={(value) => T.pose.ofCage(percent(value))}
          {...option("proportional")}
        />
      )}
    </>
  );
}

function Poses({ app }: { app: App }) {
  const state = app.store.get();
  const { poses, shares, playing, posed } = state;
  const places = poses.flatMap((pose, index) => (pose.fits ? [{ pose, index }] : []));
  const others = poses.length - places.length;
  const list = useRef<HTMLUListElement>(null);
  /** Index in `places` to which a card is being dragged; null without a drag. */
  const [over, setOver] = useState<number | null>(null);
  const count = useRef(poses.length);
  useLayoutEffect(() => {
    // A pose that was just saved is the last of the list, and the blend consists of it alone.
    const isSaved = poses.length === count.current + 1 && shares.at(-1) === 1;
    count.current = poses.length;
    if (isSaved) list.current?.lastElementChild?.scrollIntoView({ block: "nearest" });
  });
  const move = (from: number, to: number) => {
    const [index, target] = [places[from]?.index, places[to]?.index];
    if (index === undefined || target === undefined || index === target) return;
    app.poses.move(index, target);
    list.current?.children[to]?.querySelector<HTMLElement>(".grip")?.focus();
  };
  /** Index in `places` of the card at the height `y` of the window, CSS pixels. */
  const placeAt = (y: number) => {
    const middles = [...(list.current?.children ?? [])].map((card) => card.getBoundingClientRect());
    return Math.max(0, middles.filter(({ top }) => top <= y).length - 1);
  };
  return (
    <>
      <div class="row">
        <Button
          label={playing ? T.pose.stop : T.pose.play}
          onClick={() => app.run("play")}
          icon={playing ? "stop" : "play"}
          disabled={places.length === 0}
        />
        <Button
          label={T.pose.reset}
          onClick={() => app.run("resetPose")}
          icon="reset"
          tip={T.pose.resetTip(app.key("resetPose"))}
          disabled={!posed}
        />
      </div>
      {poses.length === 0 && (
        <div class="empty-state">
          <Icon name="pose" />
          <p>{T.pose.empty}</p>
          <Button label={T.pose.save} onClick={() => app.run("savePose")} icon="plus" />
        </div>
      )}
      {/* Pictures are drawn while the pointer is here, because they delay picking in the view. */}
      <ul
        class="poses"
        ref={list}
        onPointerEnter={() => void app.poses.drawPictures()}
        onFocusIn={() => void app.poses.drawPictures()}
      >
        {places.map(({ pose, index }, place) => (
          <PoseRow
            key={index}
            app={app}
            pose={pose}
            index={index}
            isOver={over === place}
            share={shares[index] ?? 0}
            onDrag={(y) => setOver(placeAt(y))}
            onDrop={(y) => {
              setOver(null);
              if (y !== null) move(place, placeAt(y));
            }}
            onStep={(by) => move(place, place + by)}
          />
        ))}
      </ul>
      {others > 0 && <p class="hint">{T.pose.waiting(others)}</p>}
      {places.length > 0 && <Timing app={app} />}
    </>
  );
}

/** Options for the animation of the poses: how it interpolates, whether it returns to its start, and its length. */
function Timing({ app }: { app: App }) {
  const state = app.store.get();
  const { transition, animationSeconds } = state;
  const last = fittingPoses(state).at(-1)?.seconds ?? 0;
  const option = fieldsOf(transition, (patch) => app.poses.transition({ ...transition, ...patch }));
  return (
    <>
      <Segments
        label={T.pose.between}
        labels={T.pose.interpolations}
        tips={T.pose.interpolationTips}
        {...option("interpolation")}
      />
      <Toggle label={T.pose.loop} sentence={T.pose.loopSentence} {...option("loops")} />
      {transition.loops && (
        <NumberField
          label={T.pose.length}
          value={thousandths(animationSeconds)}
          min={last}
          onChange={(seconds) => option("back").onChange(seconds - last)}
        />
      )}
    </>
  );
}

const NAME_FIELD = { class: "pose-name", rows: 1, maxLength: 60 };

interface PoseRowProps {
  app: App;
  pose: PoseView;
  index: number;
  /** Whether the card that is being dragged would be dropped at this row. */
  isOver: boolean;
  share: number;
  /** `y`: position of the pointer in the window; null if the drag was cancelled. */
  onDrag: (y: number) => void;
  onDrop: (y: number | null) => void;
  onStep: (by: 1 | -1) => void;
}

function PoseRow({ app, pose, index, isOver, share, onDrag, onDrop, onStep }: PoseRowProps) {
  const { playingPose, pictures } = app.store.get();
  const { name, seconds, interpolation, hash } = pose;
  const picture = pictures[hash];
  const onPose = (act: (index: number) => void) => () => {
    const place = app.poses.indexOf(pose, index);
    if (place !== undefined) act(place);
  };
  return (
    <li
      class={isOver ? "card pose over" : "card pose"}
      aria-current={playingPose === name ? "true" : undefined}
      onKeyDown={(event) => {
        if (!event.altKey || (event.key !== "ArrowUp" && event.key !== "ArrowDown")) return;
        event.preventDefault();
        onStep(event.key === "ArrowUp" ? -1 : 1);
      }}
    >
      <div class="row">
        <button
          type="button"
          class="icon-button small grip"
          aria-label={T.pose.move(name)}
          data-tip={T.pose.moveTip}
          onPointerDown={(event) => event.currentTarget.setPointerCapture(event.pointerId)}
          onPointerMove={(event) => {
            if (event.currentTarget.hasPointerCapture(event.pointerId)) onDrag(event.clientY);
          }}
          onPointerUp={(event) => onDrop(event.clientY)}
          onPointerCancel={() => onDrop(null)}
        >
          <Icon name="grip" />
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
        <Button
          label={T.pose.show}
          onClick={onPose(app.poses.apply)}
          tip={T.pose.showTip(name, app.key("undo"))}
        />
        <IconButton
          icon="trash"
          label={T.pose.delete(name)}
          onClick={onPose(app.poses.remove)}
          kind="small"
        />
      </div>
      <div class="row">
        {picture && <img class="pose-picture" src={picture} alt="" width="64" height="48" />}
        <div class="pose-time">
          <NumberInput
            name={T.pose.timeOf(name)}
            value={thousandths(seconds)}
            min={0}
            onChange={(value) => app.poses.time(index, value)}
          />
          <span aria-hidden="true">s</span>
        </div>
        <Button label={T.pose.update} name={T.pose.updateOf(name)} onClick={onPose(app.poses.update)} />
        <IconButton
          icon="copy"
          label={T.pose.duplicate(name)}
          onClick={onPose(app.poses.duplicate)}
          kind="small"
        />
      </div>
      <Select
        label={T.pose.motion}
        name={T.pose.motionOf(name)}
        kind="row"
        none={T.pose.motionOfAll}
        options={INTERPOLATIONS.map((known) => [known, T.pose.interpolations[known]])}
        value={interpolation}
        onChange={(chosen) => app.poses.interpolation(index, chosen)}
      />
      <Slider
        label={T.pose.blend}
        name={T.pose.blendOf(name)}
        {...SHARES}
        value={share}
        onChange={(value) => app.poses.blend(index, value, false)}
        onCommit={(value) => app.poses.blend(index, value, true)}
      />
    </li>
  );
}

/** Rounds seconds to thousandths: removes the digits that conversion from a 32-bit number adds. */
function thousandths(seconds: number): number {
  return Number(seconds.toFixed(3));
}
