import { expect, it } from "vitest";
import { attachDrafts, commitDraft, createDraft, numberIn } from "../src/draft";

/** A field that shows `value`, like the page's. `refuse`: what its owner does not accept. */
function field(value: string, refuse = "") {
  const element = { value: "" };
  const draft = createDraft<string>();
  const commits: string[] = [];
  const parse = (text: string) => (text === "?" ? undefined : text.trim());
  const onCommit = (text: string) => {
    if (text === refuse) return false;
    commits.push(text);
    own.value = text;
    return true;
  };
  const own = {
    value,
    element,
    draft,
    commits,
    /** Draws the field again, as a panel does whenever its state changes. */
    draw: () => draft.update(element, { text: own.value, parse, onCommit }),
    write(text: string) {
      element.value = text;
      draft.type();
    },
  };
  own.draw();
  return own;
}

it("shows the value in use, and follows it", () => {
  const one = field("Pose 1");
  expect(one.element.value).toBe("Pose 1");
  one.value = "Pose 2";
  one.draw();
  expect(one.element.value).toBe("Pose 2");
});

it("keeps what is typed while the panel is drawn again, and commits it once", () => {
  const one = field("old");
  one.write("new");
  one.draw();
  one.value = "changed by a job";
  one.draw();
  expect(one.element.value).toBe("new");
  one.draft.commit();
  one.draft.commit();
  commitDraft();
  one.draw();
  expect([one.commits, one.element.value]).toEqual([["new"], "new"]);
});

it("commits before actions, and before another field is typed into", () => {
  const [one, other] = [field("a"), field("b")];
  one.write("first");
  other.write("second");
  expect(one.commits).toEqual(["first"]);
  commitDraft();
  expect([one.commits, other.commits]).toEqual([["first"], ["second"]]);
});

it("commits once if the commit itself runs an action", () => {
  const one = field("a");
  const draft = createDraft<string>();
  const commits: string[] = [];
  const onCommit = (text: string) => {
    commitDraft();
    commits.push(text);
  };
  draft.update(one.element, { text: "a", parse: (text) => text, onCommit });
  one.element.value = "b";
  draft.type();
  draft.commit();
  expect(commits).toEqual(["b"]);
});

it("commits on presses outside the field, and when the page is left", () => {
  const page = new EventTarget();
  attachDrafts(page);
  for (const type of ["pointerdown", "click", "drop", "pagehide"]) {
    const one = field("a");
    one.write(type);
    page.dispatchEvent(new Event(type));
    expect(one.commits).toEqual([type]);
  }
});

it("shows the value in use after a refusal, after dropping, and for the same value written differently", () => {
  const one = field("name", "");
  one.write(" ");
  one.draft.commit();
  expect([one.commits, one.element.value]).toEqual([[], "name"]);
  one.write("abc");
  one.draft.drop();
  one.draft.commit();
  expect([one.commits, one.element.value]).toEqual([[], "name"]);
  one.write(" name ");
  one.draft.commit();
  one.draw();
  expect(one.element.value).toBe("name");
});

it("keeps malformed text, marked, until the user or the value changes", () => {
  const one = field("1");
  one.write("?");
  one.draft.commit();
  one.draw();
  expect([one.element.value, one.draft.isMalformed(), one.commits]).toEqual(["?", true, []]);
  one.value = "2";
  one.draw();
  expect([one.element.value, one.draft.isMalformed()]).toEqual(["2", false]);
});

it("reads numbers of a range", () => {
  const range = { min: 0, max: 10, step: 0.5 };
  expect(["0", "10", "2.5", " 3 "].map((text) => numberIn(text, range))).toEqual([0, 10, 2.5, 3]);
  for (const text of ["", " ", "-0.5", "10.5", "2.3", "1e999", "two"]) {
    expect(numberIn(text, range), text).toBeUndefined();
  }
  expect(numberIn("-1e-3", {})).toBe(-0.001);
});
