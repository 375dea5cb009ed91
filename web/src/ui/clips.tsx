/** Clips and morph targets of a rigged model, and the options of its skeleton. */

import type { App } from "../app";
import { rigOf } from "../derived";
import { duration, percent } from "../format";
import { T } from "../words";
import { Fold, fieldsOf, IconButton, Segments, Select, SHARES, Slider, switchOf, Toggle } from "./controls";

const SPEEDS = [0.25, 0.5, 1];

export function Clips({ app }: { app: App }) {
  const { model, clip, bound, rigOptions, scene } = app.store.get();
  if (!model) return null;
  const { clips } = model;
  const length = clips[clip.clip ?? -1]?.seconds ?? 0;
  const joints = fieldsOf(scene, app.view.scene)("joints");
  return (
    <div class="stack">
      {clips.length > 0 && (
        <Select
          label={T.clips.clip}
          none={T.clips.rest}
          options={clips.map(({ name, seconds }, k) => [k, T.clips.named(name, duration(1000 * seconds))])}
          disabled={!bound}
          value={clip.clip}
          onChange={(k) => void app.clips.choose(k)}
        />
      )}
      {clip.clip !== null && (
        <>
          <p class="hint">{clip.playing ? T.clips.playing : T.clips.paused}</p>
          <div class="row">
            <IconButton
              icon={clip.playing ? "pause" : "play"}
              label={clip.playing ? T.clips.pause : T.clips.play}
              {...app.command("playClip")}
            />
            <div class="grow">
              <Slider
                label={T.clips.time}
                min={0}
                max={length}
                step={length / 200}
                format={(seconds) => T.clips.seconds(seconds)}
                value={clip.seconds}
                onChange={(seconds) => void app.clips.scrub(seconds)}
              />
            </div>
          </div>
          <Segments
            label={T.clips.speed}
            values={SPEEDS}
            labels={percent}
            value={clip.speed}
            onChange={app.clips.speed}
          />
          <Toggle label={T.clips.loop} value={clip.loop} onChange={app.clips.loop} />
        </>
      )}
      {clips.length > 0 && (
        <Toggle
          label={T.clips.dynamic}
          sentence={T.clips.dynamicSentence}
          {...fieldsOf(rigOptions, app.clips.rig)("dynamic")}
        />
      )}
      {model.targets.length > 0 && (
        <Fold title={T.clips.targets(model.targets.length)}>
          {model.targets.map(({ name, default: atRest }, k) => (
            <Slider
              key={k}
              label={name}
              {...SHARES}
              value={clip.targets[k] ?? atRest}
              onChange={(weight) => void app.clips.target(k, weight)}
            />
          ))}
        </Fold>
      )}
      {model.joints > 0 && (
        <Toggle
          label={T.clips.joints}
          sentence={T.clips.jointsSentence}
          {...switchOf(joints, "follow", null)}
        />
      )}
      {model.rigged && !rigOptions.dynamic && <RigChoices app={app} />}
    </div>
  );
}

export function RigChoices({ app }: { app: App }) {
  const { rigOptions, model } = app.store.get();
  if (!model?.joints) return null;
  const { joints, rigid } = rigOptions;
  const option = fieldsOf(rigOptions, app.clips.rig);
  const follow = switchOf(option("joints"), "follow", "stay");
  const feet = switchOf(option("feet"), "lock", "free");
  const turn = switchOf(option("joints"), "turn", "follow");
  return (
    <>
      <Toggle label={T.clips.follow} sentence={T.clips.followSentence} {...follow} />
      {joints !== "stay" && (
        <>
          <Toggle
            label={T.clips.ground}
            sentence={T.clips.groundSentence}
            value={rigOf(app.store.get()).ground}
            onChange={(ground) => void app.clips.rig({ ground, ground_off: !ground })}
          />
          <Toggle label={T.clips.feet} sentence={T.clips.feetSentence} {...feet} />
          {model.props.length > 0 && (
            <Fold title={T.clips.rigid(rigid.length, model.props.length)}>
              <p class="hint">{T.clips.rigidSentence}</p>
              {[...new Set(model.props)].map((name) => {
                const setRigid = (on: boolean) => {
                  const others = rigid.filter((other) => other !== name);
                  void app.clips.rig({ rigid: on ? [...others, name] : others });
                };
                return <Toggle key={name} label={name} value={rigid.includes(name)} onChange={setRigid} />;
              })}
            </Fold>
          )}
          <Fold title={T.clips.advanced}>
            <Toggle label={T.clips.turn} sentence={T.clips.turnSentence} {...turn} />
            <Toggle label={T.clips.travel} sentence={T.clips.travelSentence} {...option("keep_travel")} />
          </Fold>
        </>
      )}
    </>
  );
}
