/** The timeline below the view: saved poses as keys to move, clips, the playhead, and everything about motion. */

import { useRef, useState } from "preact/hooks";
import type { App } from "../app";
import type { Interpolation, PoseView } from "../contract";
import { animationName, currentPose, fittingPoses } from "../derived";
import { duration } from "../format";
import type { AppState } from "../state";
import { T } from "../words";
import { fieldsOf, IconButton, NumberField, Segments, Select, TextEntry, useUid } from "./controls";

const SPEEDS = [0.25, 0.5, 1, 2];
const INTERPOLATIONS = ["step", "linear", "cubic"] as const satisfies readonly Interpolation[];
/** Step of keys that are moved, and of the playhead, seconds. */
const STEP = 0.05;
/** Room after the end of the animation, into which keys can be moved, as a fraction of its length. */
const ROOM = 0.15;

/** Whether the timeline is shown: in the steps Pose and Export, if there is a clip or more than one pose. */
export function hasTimeline(state: AppState): boolean {
  const { step, model, walk, editingRest, bound, tour } = state;
  const hasMotion = (model?.clips.length ?? 0) > 0 || walk !== null || fittingPoses(state).length > 1;
  const isWanted = tour === null || tour.name === "first";
  return hasMotion && bound && !editingRest && isWanted && (step === "pose" || step === "export");
}

export function Timeline({ app }: { app: App }) {
  return hasTimeline(app.store.get()) ? <Shown app={app} /> : null;
}

function Shown({ app }: { app: App }) {
  const [isOpen, setOpen] = useState(false);
  const { clip, walk } = app.store.get();
  const hasPoses = clip.clip === null && walk === null;
  return (
    <section class="timeline" aria-label={T.timeline.title}>
      <div class="row timeline-row">
        <Source app={app} />
        {clip.clip === null ? <CageControls app={app} /> : <ClipControls app={app} />}
        <IconButton
          icon="options"
          label={T.timeline.options}
          kind="small"
          pressed={isOpen}
          onClick={() => setOpen(!isOpen)}
        />
      </div>
      {isOpen && (
        <div class="timeline-options">
          <Segments
            label={T.timeline.speed}
            values={SPEEDS}
            labels={T.timeline.times}
            value={clip.speed}
            onChange={app.clips.speed}
          />
          {hasPoses && <Motion app={app} />}
        </div>
      )}
    </section>
  );
}

/** Selects what the timeline shows: the saved poses, a clip of the model, or a clip of another rig. */
function Source({ app }: { app: App }) {
  const { model, clip, walk } = app.store.get();
  const n = fittingPoses(app.store.get()).length;
  const clips = walk ? walk.clips.map(([name, seconds]) => ({ name, seconds })) : (model?.clips ?? []);
  if (clips.length === 0) return <strong class="timeline-source">{T.timeline.poses(n)}</strong>;
  return (
    <Select
      kind="timeline-source"
      label={T.timeline.source}
      hideLabel
      none={n > 0 ? T.timeline.poses(n) : T.clips.rest}
      options={clips.map(({ name, seconds }, k) => [k, T.clips.named(name, duration(1000 * seconds))])}
      value={walk ? walk.clip : clip.clip}
      onChange={(k) => (walk ? app.walk.choose(k) : void app.clips.choose(k))}
    />
  );
}

/** Playback of a clip of the model. */
function ClipControls({ app }: { app: App }) {
  const { clip, model } = app.store.get();
  const length = model?.clips[clip.clip ?? -1]?.seconds ?? 0;
  return (
    <>
      <IconButton
        icon={clip.playing ? "pause" : "play"}
        label={clip.playing ? T.clips.pause : T.clips.play}
        {...app.command("playClip")}
      />
      <Loop isOn={clip.loop} onChange={app.clips.loop} />
      <div class="track">
        <Playhead value={clip.seconds} max={length} onInput={(seconds) => void app.clips.scrub(seconds)} />
      </div>
      <Time seconds={clip.seconds} length={length} />
    </>
  );
}

/** Playback of the saved poses, or of a clip that the cage follows. */
function CageControls({ app }: { app: App }) {
  const { playing, moment, transition, animationSeconds, walk } = app.store.get();
  const poses = fittingPoses(app.store.get());
  if (!walk && poses.length === 0) return <p class="hint grow">{T.timeline.chooseClip}</p>;
  const length = walk ? (walk.clips[walk.clip]?.[1] ?? 0) : animationSeconds;
  return (
    <>
      <IconButton
        icon={playing ? "stop" : "play"}
        label={playing ? T.timeline.stop : T.timeline.play}
        {...app.command("play")}
      />
      {!walk && (
        <Loop isOn={transition.loops} onChange={(loops) => app.poses.transition({ ...transition, loops })} />
      )}
      {walk ? (
        <div class="track">
          <Playhead value={moment} max={length} onInput={app.poses.scrub} onCommit={app.poses.keepMoment} />
        </div>
      ) : (
        <Keys app={app} />
      )}
      <Time seconds={moment} length={length} />
    </>
  );
}

function Loop({ isOn, onChange }: { isOn: boolean; onChange: (isOn: boolean) => void }) {
  return <IconButton icon="loop" label={T.timeline.loop} pressed={isOn} onClick={() => onChange(!isOn)} />;
}

function Time({ seconds, length }: { seconds: number; length: number }) {
  return <span class="timeline-time">{T.timeline.time(seconds, length)}</span>;
}

interface PlayheadProps {
  value: number;
  max: number;
  onInput: (seconds: number) => void;
  onCommit?: () => void;
}

function Playhead({ value, max, onInput, onCommit }: PlayheadProps) {
  return (
    <input
      type="range"
      class="playhead"
      min={0}
      max={max}
      step={Math.min(STEP, max / 100)}
      value={value}
      aria-label={T.timeline.playhead}
      aria-valuetext={T.clips.seconds(value)}
      onInput={(event) => onInput(event.currentTarget.valueAsNumber)}
      onChange={onCommit}
    />
  );
}

/** A key of the timeline that is being moved. */
interface Moved {
  /** Index of the pose in the document; "end" is the end of the animation. */
  readonly key: number | "end";
  readonly seconds: number;
}

/** The saved poses as keys, which can be dragged or moved with the arrow keys, and the playhead. */
function Keys({ app }: { app: App }) {
  const state = app.store.get();
  const { poses, moment, transition, animationSeconds, playingPose, pictures } = state;
  const [moved, setMoved] = useState<Moved | null>(null);
  const track = useRef<HTMLDivElement>(null);
  const span = Math.max(animationSeconds, 0.5) * (1 + ROOM);
  const last = fittingPoses(state).at(-1)?.seconds ?? 0;
  const put = ({ key, seconds }: Moved) => {
    if (key === "end") app.poses.transition({ ...transition, back: seconds - last });
    else app.poses.time(key, seconds);
  };
  const keyOf = (key: Moved["key"], seconds: number, label: string, onClick?: () => void) => {
    const shown = moved?.key === key ? moved.seconds : seconds;
    const at = (x: number) => {
      const { left = 0, width = 1 } = track.current?.getBoundingClientRect() ?? {};
      const least = key === "end" ? last + STEP : 0;
      return Math.max(least, Math.round((((x - left) / width) * span) / STEP) * STEP);
    };
    const pose = key === "end" ? undefined : poses[key];
    return (
      <button
        type="button"
        class={key === "end" ? "key end" : "key"}
        key={key}
        style={{ "--at": shown / span }}
        aria-label={label}
        aria-current={pose && pose.name === playingPose ? "true" : undefined}
        aria-pressed={key === "end" ? undefined : key === currentPose(state)}
        data-tip={label}
        onPointerDown={(event) => event.currentTarget.setPointerCapture(event.pointerId)}
        onPointerMove={(event) => {
          if (!event.currentTarget.hasPointerCapture(event.pointerId)) return;
          const seconds = at(event.clientX);
          if (moved || Math.abs(seconds - shown) >= STEP) setMoved({ key, seconds });
        }}
        onPointerUp={() => {
          if (moved) put(moved);
        }}
        onPointerCancel={() => setMoved(null)}
        onClick={() => {
          if (!moved) onClick?.();
          setMoved(null);
        }}
        onKeyDown={(event) => {
          const by = { ArrowLeft: -STEP, ArrowRight: STEP }[event.key];
          if (by === undefined) return;
          event.preventDefault();
          put({ key, seconds: Math.max(0, seconds + by) });
        }}
      >
        {pose && pictures[pose.hash] && <img src={pictures[pose.hash]} alt="" width="32" height="24" />}
      </button>
    );
  };
  return (
    <div class="track keys-track" ref={track}>
      <Playhead
        value={Math.min(moment, animationSeconds)}
        max={span}
        onInput={(seconds) => app.poses.scrub(Math.min(seconds, animationSeconds))}
        onCommit={app.poses.keepMoment}
      />
      {poses.map((pose: PoseView, index) =>
        pose.fits
          ? keyOf(index, pose.seconds, T.timeline.key(pose.name, pose.seconds), () => app.poses.apply(index))
          : null,
      )}
      {transition.loops && keyOf("end", animationSeconds, T.timeline.end(animationSeconds))}
    </div>
  );
}

/** Name of the animation, interpolation between poses, and the time and motion of the pose that is shown. */
function Motion({ app }: { app: App }) {
  const state = app.store.get();
  const { transition, poses } = state;
  const option = fieldsOf(transition, (patch) => app.poses.transition({ ...transition, ...patch }));
  const id = useUid();
  const index = currentPose(state);
  const pose = index === undefined ? undefined : poses[index];
  return (
    <>
      <div class="field">
        <label for={id}>{T.timeline.name}</label>
        <TextEntry
          text={transition.name}
          parse={(text) => text.trim()}
          onCommit={option("name").onChange}
          attributes={{ id, type: "text", maxLength: 60, placeholder: animationName(state) }}
        />
      </div>
      <Segments
        label={T.timeline.between}
        labels={T.timeline.interpolations}
        tips={T.timeline.interpolationTips}
        {...option("interpolation")}
      />
      {pose && index !== undefined && (
        <>
          <NumberField
            label={T.timeline.timeOf(pose.name)}
            value={Number(pose.seconds.toFixed(3))}
            min={0}
            onChange={(seconds) => app.poses.time(index, seconds)}
          />
          <Select
            label={T.timeline.motionOf(pose.name)}
            none={T.timeline.motionOfAll}
            options={INTERPOLATIONS.map((known) => [known, T.timeline.interpolations[known]])}
            value={pose.interpolation}
            onChange={(chosen) => app.poses.interpolation(index, chosen)}
          />
        </>
      )}
    </>
  );
}
