/** Step 2: source of the cage, its problems, and reshaping. */

import type { App } from "../app";
import type { CageOptions, CageState, Problem } from "../contract";
import { SLIDERS } from "../defaults";
import { fixOf, isCageSparse, type ProblemFix } from "../derived";
import { count, percent } from "../format";
import { sentence } from "../strings";
import { T } from "../words";
import { Automatic } from "./cage-options";
import { Badge, Button, fieldsOf, Head, Say, Section, Segments, Slider, Toggle } from "./controls";
import { Icon } from "./icons";
import { Inside, Smooth } from "./inside";

export function CagePanel({ app }: { app: App }) {
  const { cageSource, cagePreview, cageProgress, cage, check } = app.store.get();
  const option = fieldsOf(app.store.get(), app.store.set);
  return (
    <div class="stack loose">
      <Head title={T.cage.title} sentence={cage ? undefined : T.cage.sentence} />
      <div class="stack">
        <Segments
          label={T.cage.how}
          hideLabel
          labels={T.cage.sources}
          tips={T.cage.about}
          {...option("cageSource")}
        />
        {cageSource === "auto" && <Automatic app={app} />}
        {cageSource === "box" && (
          <Slider label={T.cage.divisions} {...SLIDERS.divisions} {...option("boxDivisions")} />
        )}
        {cagePreview !== null && <p class="hint">{T.cage.preview(cagePreview)}</p>}
        {cageProgress !== null && (
          <progress max="1" value={cageProgress} aria-label={T.cage.making}>
            {percent(cageProgress)}
          </progress>
        )}
      </div>
      <Section title={T.cage.result}>
        <div class="stack">
          {cage ? <CageCard cage={cage} check={check} /> : <p class="empty">{T.cage.none}</p>}
          {isCageSparse(app.store.get()) && <p class="hint">{sparse(app.store.get().cageOptions)}</p>}
          {check?.map((problem) => (
            <ProblemCard key={problem.message} problem={problem} app={app} />
          ))}
        </div>
      </Section>
      {cage && (
        <div class="stack">
          <Reshape app={app} />
          <Smooth app={app} cage={cage} />
          <Inside app={app} cage={cage} />
        </div>
      )}
    </div>
  );
}

/** Sentence that says why a cage has fewer vertices than requested, and which option would change that. */
function sparse({ target, detail }: CageOptions): string {
  const share = percent(detail, 1);
  return detail > 1.01 * SLIDERS.detail.min ? T.cage.sparse(share, count(target)) : T.cage.sparsest(share);
}

function Reshape({ app }: { app: App }) {
  const { editingRest, tools } = app.store.get();
  return (
    <div class="stack">
      <Toggle
        label={T.cage.reshape}
        sentence={T.cage.reshapeSentence(app.key("restMode"))}
        value={editingRest}
        onChange={app.edit.setEditingRest}
      />
      {editingRest && <p class="hint">{T.cage.hints[tools.element]}</p>}
    </div>
  );
}

function CageCard({ cage, check }: { cage: CageState; check: readonly Problem[] | null }) {
  return (
    <div class="card stack tight">
      <div class="row wrap">
        <strong
          data-tip={T.cage.facts(
            cage.info.faces,
            percent(cage.info.quads / Math.max(cage.info.faces, 1)),
            cage.info.edges,
          )}
        >
          {T.cage.vertices(cage.info.vertices)}
        </strong>
        <CageBadge cage={cage} check={check} />
      </div>
      {cage.info.notices.map((notice) => (
        <Say key={notice} kind="hint" text={sentence(notice)} />
      ))}
    </div>
  );
}

function CageBadge({ cage, check }: { cage: CageState; check: readonly Problem[] | null }) {
  if (!cage.usable) return <Badge kind="bad" icon="warning" text={T.cage.needsRepair} />;
  if (!check) return <span class="badge">{T.cage.checking}</span>;
  return check.some((problem) => problem.code === "model_outside") ? (
    <Badge kind="warn" icon="warning" text={T.cage.outside} />
  ) : (
    <Badge kind="good" icon="check" text={T.cage.encloses} />
  );
}

/** Label of the button that fixes `count` faults. */
export function fixLabel(fix: ProblemFix, count: number): string {
  if (fix.kind === "repair") return T.cage.repairs[fix.repair](count);
  return fix.kind === "grid" ? T.cage.bindFiner(fix.cells) : T.panel.newCage;
}

function ProblemCard({ problem, app }: { problem: Problem; app: App }) {
  const fix = fixOf(problem);
  // If the fix is a finer grid, choosing one solves the problem.
  const isDone = fix?.kind === "grid" && app.store.get().bindOptions.grid >= fix.cells;
  return (
    <div class={`problem-card ${problem.severity}`}>
      <Icon name={problem.severity === "note" ? "info" : "warning"} />
      <Say kind="grow" text={sentence(problem.message)} />
      {fix && !isDone && (
        <Button label={fixLabel(fix, problem.count)} onClick={() => app.cage.applyFix(fix)} />
      )}
      {isDone && <Badge kind="good" icon="check" text={T.cage.fineEnough} />}
    </div>
  );
}
