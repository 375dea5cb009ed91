/** Clips and morph targets of a rigged model, and the options of its skeleton. */

import type { App } from "../app";
import { duration, percent } from "../format";
import { T } from "../words";
import { Fold, IconButton, Segments, SHARES, Slider, Toggle } from "./controls";

const SPEEDS = ["0.25", "0.5", "1"] as const;

export function Clips({ app }: { app: App }) {
  const { model, clip, bound, rigOptions, scene } = app.store.get();
  if (!model) return null;
  const { clips } = model;
  const length = clips[clip.clip ?? -1]?.seconds ?? 0;
  return (
    <div class="stack">
      {clips.length > 0 && (
        <label class="stack tight">
          <span class="legend-text">{T.clips.clip}</span>
          <select
            value={clip.clip ?? ""}
            disabled={!bound}
            onChange={({ currentTarget: { value } }) =>
              void app.clips.choose(value === "" ? null : Number(value))
            }
          >
            <option value="">{T.clips.rest}</option>
            {clips.map(({ name, seconds }, k) => (
              <option key={k} value={k}>
                {T.clips.named(name, duration(1000 * seconds))}
              </option>
            ))}
          </select>
        </label>
      )}
      {clip.clip !== null && (
        <>
          <p class="hint">{clip.playing ? T.clips.playing : T.clips.paused}</p>
          <div class="row">
            <IconButton
              icon={clip.playing ? "pause" : "play"}
              label={clip.playing ? T.clips.pause : T.clips.play}
              tip={`${clip.playing ? T.clips.pause : T.clips.play} (${app.key("playClip")})`}
              onClick={() => void app.clips.toggle()}
            />
            <div class="grow">
              <Slider
                label={T.clips.time}
                min={0}
                max={length}
                step={length / 200}
                format={(seconds) => T.clips.seconds(seconds)}
                value={clip.seconds}
                onInput={(seconds) => void app.clips.scrub(seconds)}
              />
            </div>
          </div>
          <Segments
            label={T.clips.speed}
            choices={SPEEDS.map((value) => ({ value, label: percent(Number(value)) }))}
            value={String(clip.speed)}
            onChange={(value) => app.clips.speed(Number(value))}
          />
          <Toggle label={T.clips.loop} on={clip.loop} onChange={app.clips.loop} />
        </>
      )}
      {clips.length > 0 && (
        <Toggle
          label={T.clips.dynamic}
          sentence={T.clips.dynamicSentence}
          on={rigOptions.dynamic}
          onChange={(dynamic) => app.clips.rig({ dynamic })}
        />
      )}
      {model.targets.length > 0 && (
        <Fold title={T.clips.targets(model.targets.length)}>
          <div class="stack">
            {model.targets.map(({ name, default: atRest }, k) => (
              <Slider
                key={k}
                label={name}
                {...SHARES}
                value={clip.targets[k] ?? atRest}
                onInput={(weight) => void app.clips.target(k, weight)}
              />
            ))}
          </div>
        </Fold>
      )}
      {model.joints > 0 && (
        <Toggle
          label={T.clips.joints}
          sentence={T.clips.jointsSentence}
          on={scene.joints !== null}
          onChange={(on) => app.view.scene({ joints: on ? "follow" : null })}
        />
      )}
      {model.rigged && !rigOptions.dynamic && <RigChoices app={app} />}
    </div>
  );
}

export function RigChoices({ app }: { app: App }) {
  const { rigOptions, model } = app.store.get();
  if (!model?.joints) return null;
  const { joints, keep_travel, ground, feet, rigid } = rigOptions;
  return (
    <>
      <Toggle
        label={T.clips.follow}
        sentence={T.clips.followSentence}
        on={joints !== "stay"}
        onChange={(on) => app.clips.rig({ joints: on ? "follow" : "stay" })}
      />
      {joints !== "stay" && (
        <>
          <Toggle
            label={T.clips.ground}
            sentence={T.clips.groundSentence}
            on={ground}
            onChange={(on) => app.clips.rig({ ground: on })}
          />
          <Toggle
            label={T.clips.feet}
            sentence={T.clips.feetSentence}
            on={feet === "lock"}
            onChange={(on) => app.clips.rig({ feet: on ? "lock" : "free" })}
          />
        </>
      )}
      {joints !== "stay" && model.props.length > 0 && (
        <Fold title={T.clips.rigid(rigid.length, model.props.length)}>
          <div class="stack">
            <p class="hint">{T.clips.rigidSentence}</p>
            {[...new Set(model.props)].map((name) => (
              <Toggle
                key={name}
                label={name}
                on={rigid.includes(name)}
                onChange={(on) =>
                  app.clips.rig({ rigid: on ? [...rigid, name] : rigid.filter((other) => other !== name) })
                }
              />
            ))}
          </div>
        </Fold>
      )}
      {joints !== "stay" && (
        <Fold title={T.clips.advanced}>
          <div class="stack">
            <Toggle
              label={T.clips.turn}
              sentence={T.clips.turnSentence}
              on={joints === "turn"}
              onChange={(on) => app.clips.rig({ joints: on ? "turn" : "follow" })}
            />
            <Toggle
              label={T.clips.travel}
              sentence={T.clips.travelSentence}
              on={keep_travel}
              onChange={(on) => app.clips.rig({ keep_travel: on })}
            />
          </div>
        </Fold>
      )}
    </>
  );
}
