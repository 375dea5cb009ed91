/** The section Proportions of step Pose: sliders for the parts of a humanoid, presets, and the bones that were found. */

import type { ComponentChildren } from "preact";
import { useEffect } from "preact/hooks";
import type { App } from "../app";
import type { HumanoidInfo } from "../contract";
import { PRESETS, PROPORTIONS, SLIDERS } from "../defaults";
import { list, percent } from "../format";
import { T } from "../words";
import { Button, Fold, Say, Section, Select, Slider, Toggle } from "./controls";

type Facts = (typeof PROPORTIONS)[number];

/** Proportions whose sliders are not folded. */
const MAIN: ReadonlySet<Facts["name"]> = new Set(["leg", "arm", "torso", "shoulder", "head", "height"]);
const RANGE = { ...SLIDERS.factor, format: (factor: number) => percent(factor, 0, SLIDERS.factor.max) };

export function Proportions({ app }: { app: App }) {
  const { humanoid, cage } = app.store.get();
  if (!humanoid || !cage) return null;
  if (!humanoid.source)
    return (
      <Fold title={T.proportions.unknown}>
        {humanoid.fault && <Say text={{ english: humanoid.fault }} kind="hint" />}
        <Bones app={app} humanoid={humanoid} />
      </Fold>
    );
  return (
    <Section title={T.proportions.title}>
      <Presets app={app} />
      <Sliders app={app}>
        <Fold title={T.proportions.bones}>
          <p class="hint">{T.proportions.sources[humanoid.source]}</p>
          <Bones app={app} humanoid={humanoid} />
        </Fold>
      </Sliders>
    </Section>
  );
}

function Presets({ app }: { app: App }) {
  const { preset } = app.store.get();
  return (
    <div class="row wrap">
      {PRESETS.map((name) => (
        <Button
          key={name}
          label={T.proportions.presets[name]}
          pressed={preset === name}
          onClick={() => app.proportions.preset(name)}
        />
      ))}
    </div>
  );
}

/** A slider: the name of its proportion in commands, its title and its value. */
type Entry = readonly [name: string, title: string, factor: number];

function Sliders({ app, children }: { app: App; children: ComponentChildren }) {
  const { factors, folds, bound, bindRun, apart, scaled } = app.store.get();
  useEffect(() => void app.proportions.measure(), [bound, bindRun, folds]);
  const sidesOf = (facts: Facts) => {
    const k = 2 * PROPORTIONS.indexOf(facts);
    return [factors[k] ?? 1, factors[k + 1] ?? 1] as const;
  };
  const isApart = apart || PROPORTIONS.some((facts) => sidesOf(facts)[0] !== sidesOf(facts)[1]);
  const entries = (facts: Facts): readonly Entry[] => {
    const { name, sided } = facts;
    const title = T.proportions.titles[name];
    const [left, right] = sidesOf(facts);
    if (!sided || !isApart) return [[name, title, left]];
    return [
      [`left_${name}`, T.proportions.left(title), left],
      [`right_${name}`, T.proportions.right(title), right],
    ];
  };
  const rangeOf = (facts: Facts) =>
    folds?.find(({ proportion }) => proportion === facts.name) ?? SLIDERS.factor;
  const folded = PROPORTIONS.flatMap((facts) => {
    const { min, max } = rangeOf(facts);
    return entries(facts).filter(([, , factor]) => factor < min || factor > max);
  });
  const sliders = (isMain: boolean) => (
    <div class="sliders">
      {PROPORTIONS.filter(({ name }) => MAIN.has(name) === isMain).map((facts) =>
        entries(facts).map(([name, title, factor]) => (
          <Slider
            key={name}
            label={title}
            {...RANGE}
            typed
            usual={facts.natural}
            limits={rangeOf(facts)}
            value={factor}
            onChange={(value) => app.proportions.set(name, value)}
            onCommit={() => app.proportions.commit(title)}
            onReset={() => {
              app.proportions.set(name, 1);
              app.proportions.commit(title);
            }}
          />
        )),
      )}
    </div>
  );
  return (
    <>
      {sliders(true)}
      <p class="hint bands">
        <span class="natural">{T.proportions.natural}</span>
        {folds && folds.length > 0 && <span class="folding">{T.proportions.folding}</span>}
      </p>
      {folded.length > 0 && (
        <p class="hint warn-text">{T.proportions.folds(list(folded.map(([, title]) => title)))}</p>
      )}
      {scaled && (
        <Button
          label={T.proportions.resetAll}
          icon="reset"
          tip={T.proportions.resetTip}
          onClick={() => app.proportions.preset(null)}
        />
      )}
      <Fold title={T.more}>
        {sliders(false)}
        <Toggle label={T.proportions.apart} value={isApart} onChange={app.proportions.apart} />
        {children}
      </Fold>
    </>
  );
}

function Bones({ app, humanoid }: { app: App; humanoid: HumanoidInfo }) {
  return (
    <>
      {humanoid.bones.map(({ bone, joint }) => (
        <Select
          key={bone}
          label={T.proportions.bone[bone]}
          kind="bone"
          none={T.proportions.automatic}
          options={humanoid.joints.map((name) => [name, name])}
          value={joint}
          onChange={(name) => app.proportions.bone(bone, name)}
        />
      ))}
    </>
  );
}
