import { expect, it } from "vitest";
import { createEdit } from "../../src/actions/edit";
import { createPainting } from "../../src/actions/painting";
import { createFake, memberOf, modelOf } from "../fake";

/**
 * A page with two models of eight vertices. A dab at the pixel (x, y) paints the vertex floor(x / 10), or nothing if
 * y < 100.
 */
function page() {
  const fake = createFake();
  let amounts = new Uint8Array();
  const before = amounts;
  const shown: (number | undefined)[] = [];
  const dabs: number[] = [];
  fake.teach({
    painted: () => amounts.slice(),
    revert() {
      amounts = before;
    },
    showPainting: (id?: number) => shown.push(id),
    paint(x: number, y: number, radius: number, amount: number) {
      if (y < 100) return false;
      amounts = amounts.length === 0 ? new Uint8Array(8) : amounts.slice();
      amounts[Math.floor(x / 10)] = amount;
      dabs.push(radius);
      return true;
    },
  });
  fake.showModel(modelOf([memberOf(0, "body.glb"), memberOf(1, "b")]));
  fake.show({ bound: true });
  const painting = createPainting(fake.ctx, createEdit(fake.ctx), () => fake.calls.push("settle"));
  return { ...fake, painting, shown, dabs, amounts: () => [...amounts] };
}

it("a stroke is one step and has no gaps at high speed", () => {
  const { painting, store, amounts, did, shown, calls } = page();
  painting.on(0);
  expect([store.get().painting, shown, calls]).toEqual([
    { id: 0, radius: 0.05, erase: false },
    [0],
    ["settle"],
  ]);
  expect(painting.begin(5, 50), "beside the model").toBe(false);
  expect([painting.begin(5, 150), painting.active()]).toEqual([true, true]);
  painting.drag(45, 150);
  painting.end(true);
  expect([painting.active(), amounts()]).toEqual([false, [255, 255, 255, 255, 255, 0, 0, 0]]);
  expect(did).toEqual(["Paint fixed areas"]);
});

it("the brush erases too and remembers its size", async () => {
  const { painting, store, amounts, dabs, did } = page();
  painting.on(0);
  painting.brush({ radius: 0.2 });
  painting.begin(5, 150);
  painting.drag(25, 150);
  painting.end(true);
  painting.brush({ erase: true });
  painting.begin(15, 150);
  painting.end(true);
  expect([amounts().slice(0, 3), new Set(dabs)]).toEqual([[255, 0, 255], new Set([0.2])]);
  expect(did.at(-1)).toBe("Erase fixed areas");
  painting.on(null);
  expect(store.get().painting).toBeNull();
  painting.on(1);
  expect(store.get().painting).toEqual({ id: 1, radius: 0.2, erase: false });
});

it("a cancelled stroke changes nothing; clearing is an undo step", () => {
  const { painting, amounts, commands, did } = page();
  painting.on(0);
  painting.begin(5, 150);
  painting.end(false);
  expect([amounts(), did]).toEqual([[], []]);
  painting.clear(0);
  expect(did, "there was nothing to clear").toEqual([]);
  painting.begin(5, 150);
  painting.end(true);
  painting.clear(0);
  expect([commands, did.at(-1)]).toEqual([
    [{ do: "set_painted", id: 0, amounts: [] }],
    "Clear painted areas",
  ]);
});

it("reports models that cannot be painted yet", () => {
  const { painting, problems, teach } = page();
  painting.on(0);
  teach({
    paint() {
      throw new Error("the model has no weights yet");
    },
  });
  expect([painting.begin(5, 150), painting.active(), problems.length]).toEqual([false, false, 1]);
});

it("the brush outline shows where it would paint", () => {
  const { painting, teach } = page();
  teach({ brushRadius: (_x: number, y: number, radius: number) => (y < 100 ? undefined : 100 * radius) });
  expect(painting.radiusAt(5, 150), "not painting").toBeNull();
  painting.on(0);
  expect([painting.radiusAt(5, 150), painting.radiusAt(5, 50)]).toEqual([5, null]);
});

it("removing the model or reshaping the cage ends painting", () => {
  const { painting, store, shown } = page();
  painting.on(0);
  store.set({ model: modelOf([memberOf(1, "b")]) });
  expect([store.get().painting, shown.at(-1)]).toEqual([null, undefined]);
  painting.on(1);
  store.set({ editingRest: true });
  expect(store.get().painting).toBeNull();
});
