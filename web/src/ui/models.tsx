/** The models that share the cage, and how their parts follow it. */

import type { Treatment } from "../actions/models";
import type { App } from "../app";
import type { MemberInfo, ModelInfo } from "../contract";
import { SLIDERS } from "../defaults";
import { percent } from "../format";
import { T } from "../words";
import { Button, Fold, fieldsOf, IconButton, Section, Segments, Slider } from "./controls";
import { Icon } from "./icons";
import { useTouch } from "./touch";

const ALL = "all";
/** The treatments that a part can have. Their icons have the same names. */
const WAYS = ["rigid", "stays"] as const satisfies readonly Treatment[];

export function Models({ app, model }: { app: App; model: ModelInfo }) {
  const [only, ...others] = model.members;
  const body = model.members.reduce((best, one) => (one.joints > best.joints ? one : best));
  const isTouch = useTouch();
  return (
    <Section title={T.models.title}>
      <div class="stack" data-adds="">
        {only && others.length === 0 && <Parts app={app} member={only} isAlone />}
        {others.length > 0 && (
          <>
            <Signs />
            <ul class="stack">
              {model.members.map((member) => (
                <Row key={member.id} app={app} member={member} body={body} />
              ))}
            </ul>
          </>
        )}
        <div class="row">
          <Button
            label={T.models.add}
            icon="plus"
            tip={isTouch ? T.models.addHintTouch : T.models.addHint}
            onClick={app.chooseMore}
          />
        </div>
      </div>
    </Section>
  );
}

/** Explains the icons of the buttons. On touch screens, tool tips appear only on a long press. */
function Signs() {
  return (
    <p class="hint signs">
      <Icon name="rigid" /> {T.models.is.rigid}
      <Icon name="stays" /> {T.models.is.stays}
    </p>
  );
}

/** `body`: the model with the most joints. */
function Row({ app, member, body }: { app: App; member: MemberInfo; body: MemberInfo }) {
  const { id, name, options, joints } = member;
  return (
    <li class="card stack tight" aria-label={name}>
      <div class="row">
        <div class="grow">
          <strong class="clip">{name}</strong>
          <p class="hint">{about(member)}</p>
        </div>
        <div class="row icons">
          <IconButton
            icon={options.shown ? "eye" : "hidden"}
            label={T.models.hide(name)}
            tip={options.shown ? T.models.hideTip : T.models.show}
            kind="small"
            pressed={!options.shown}
            onClick={() => app.models.show(id, !options.shown)}
          />
          <Ways app={app} member={member} part={ALL} label={name} />
          <IconButton
            icon="trash"
            label={T.models.remove(name)}
            kind="small"
            onClick={() => void app.models.remove(id)}
          />
        </div>
      </div>
      {joints === 0 && body.joints > 0 && (
        <div class="row">
          <Button
            label={T.models.copyRig(body.name)}
            icon="bone"
            tip={T.models.copyRigTip(body.name)}
            onClick={() => void app.models.copyRig(id, body.id)}
          />
        </div>
      )}
      <Parts app={app} member={member} />
    </li>
  );
}

/** Says how many vertices a model has, and which of its options differ from the default. */
function about({ vertices, options, painted }: MemberInfo): string {
  const { shown, rigid, stays } = options;
  const isWhole = rigid.includes(ALL) || stays.includes(ALL);
  return [
    T.models.vertices(vertices),
    !shown && T.models.is.hidden,
    rigid.includes(ALL) && T.models.is.rigid,
    stays.includes(ALL) && T.models.is.stays,
    !isWhole && T.models.some(rigid.length, stays.length),
    painted && T.models.is.painted,
  ]
    .filter(Boolean)
    .join(" · ");
}

/** Two toggle buttons for a part, of which at most one is pressed: "keeps its shape" and "stays as it is". */
function Ways(props: { app: App; member: MemberInfo; part: string; label: string; disabled?: boolean }) {
  const { app, member, part, label, disabled } = props;
  return WAYS.map((how) => (
    <IconButton
      key={how}
      icon={how}
      label={T.models[how](label)}
      tip={T.models.tips[how]}
      kind="small"
      disabled={disabled}
      pressed={member.options[how].includes(part)}
      onClick={() => app.models.part(member.id, part, how)}
    />
  ));
}

/** Lists the parts of a model, and offers to paint which vertices stay in place. */
function Parts({ app, member, isAlone = false }: { app: App; member: MemberInfo; isAlone?: boolean }) {
  const { rigid, stays } = member.options;
  const isWhole = rigid.includes(ALL) || stays.includes(ALL);
  const kinds = [...new Set(member.parts.map((part) => split(part)[0]))];
  return (
    <Fold title={T.models.parts}>
      {isAlone && (
        <>
          <Signs />
          <div class="row part">
            <span class="grow">{T.models.whole}</span>
            <Ways app={app} member={member} part={ALL} label={member.name} />
          </div>
        </>
      )}
      {kinds.map((kind) => (
        <fieldset class="stack tight" key={kind}>
          <legend class="legend-text">{T.models.kinds[kind] ?? kind}</legend>
          {member.parts
            .filter((part) => split(part)[0] === kind)
            .map((part) => (
              <div class="row part" key={part}>
                <span class="grow clip">{split(part)[1]}</span>
                <Ways app={app} member={member} part={part} label={split(part)[1]} disabled={isWhole} />
              </div>
            ))}
        </fieldset>
      ))}
      <Paint app={app} member={member} />
    </Fold>
  );
}

/** Splits "material:Cloth" into kind and name. */
function split(part: string): [kind: string, name: string] {
  const [kind = "", ...rest] = part.split(":");
  return [kind, rest.join(":")];
}

function Paint({ app, member: { id, painted } }: { app: App; member: MemberInfo }) {
  const { painting } = app.store.get();
  const isOn = painting?.id === id;
  const clear = painted && (
    <Button label={T.models.clear} icon="close" onClick={() => app.painting.clear(id)} />
  );
  if (!isOn)
    return (
      <div class="row wrap">
        <Button label={T.models.paint} icon="brush" onClick={() => app.painting.on(id)} />
        {clear}
      </div>
    );
  return (
    <fieldset class="stack" aria-label={T.models.paint}>
      <p class="hint">{T.models.paintSentence}</p>
      <Segments
        label={T.models.brush}
        labels={T.models.brushes}
        value={painting.erase ? "erase" : "paint"}
        onChange={(value) => app.painting.brush({ erase: value === "erase" })}
      />
      <Slider
        label={T.models.size}
        {...SLIDERS.brush}
        format={(share) => T.cage.ofSize(percent(share))}
        {...fieldsOf(painting, app.painting.brush)("radius")}
      />
      <div class="row wrap">
        <Button label={T.models.done} icon="check" onClick={() => app.painting.on(null)} />
        {clear}
      </div>
    </fieldset>
  );
}
