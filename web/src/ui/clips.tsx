/** Options that determine how the skeleton, morph targets and clips of a rigged model follow the cage. */

import type { App } from "../app";
import { rigOf } from "../derived";
import { T } from "../words";
import { Fold, fieldsOf, switchOf, Toggle } from "./controls";

export function RigChoices({ app }: { app: App }) {
  const { rigOptions, model } = app.store.get();
  if (!model?.rigged) return null;
  const { joints, rigid, dynamic, plain } = rigOptions;
  const option = fieldsOf(rigOptions, app.clips.rig);
  const hasJoints = model.joints > 0 && !dynamic && !plain;
  return (
    <>
      {hasJoints && joints !== "stay" && (
        <Toggle
          label={T.clips.ground}
          sentence={T.clips.groundSentence}
          value={rigOf(app.store.get()).ground}
          onChange={(ground) => void app.clips.rig({ ground, ground_off: !ground })}
        />
      )}
      <Fold title={T.clips.advanced}>
        <Toggle
          label={T.clips.keep}
          sentence={T.clips.keepSentence(model.joints, model.targets.length, model.clips.length)}
          {...switchOf(option("plain"), false, true)}
        />
        {hasJoints && (
          <Toggle
            label={T.clips.follow}
            sentence={T.clips.followSentence}
            {...switchOf(option("joints"), "follow", "stay")}
          />
        )}
        {hasJoints && joints !== "stay" && (
          <>
            <Toggle
              label={T.clips.feet}
              sentence={T.clips.feetSentence}
              {...switchOf(option("feet"), "lock", "free")}
            />
            <Toggle
              label={T.clips.turn}
              sentence={T.clips.turnSentence}
              {...switchOf(option("joints"), "turn", "follow")}
            />
            <Toggle label={T.clips.travel} sentence={T.clips.travelSentence} {...option("keep_travel")} />
          </>
        )}
        {model.clips.length > 0 && (
          <Toggle label={T.clips.dynamic} sentence={T.clips.dynamicSentence} {...option("dynamic")} />
        )}
        {hasJoints && joints !== "stay" && model.props.length > 0 && (
          <fieldset class="stack tight">
            <legend class="legend-text" data-tip={T.clips.rigidSentence}>
              {T.clips.rigid(rigid.length, model.props.length)}
            </legend>
            {[...new Set(model.props)].map((name) => {
              const setRigid = (on: boolean) => {
                const others = rigid.filter((other) => other !== name);
                void app.clips.rig({ rigid: on ? [...others, name] : others });
              };
              return <Toggle key={name} label={name} value={rigid.includes(name)} onChange={setRigid} />;
            })}
          </fieldset>
        )}
      </Fold>
    </>
  );
}
