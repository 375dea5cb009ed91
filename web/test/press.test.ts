import { expect, it } from "vitest";
import { createPress } from "../src/input/press";

const button = (isConnected = true) => {
  const own: { isConnected: boolean; contains: (other: unknown) => boolean } = {
    isConnected,
    contains: (other) => other === own,
  };
  return own;
};
const BOX = { left: 10, top: 10, right: 50, bottom: 30 };
const panel = {};

it("a click reaches the button that was pressed, wherever a redraw has moved it", () => {
  const press = createPress();
  const [one, other] = [button(), button()];
  press.down(1, one, BOX);
  press.up(1, 20, 20);
  expect(press.click(one), "the button did not move").toBe("as is");
  for (const around of [panel, other]) {
    press.down(1, one, BOX);
    press.up(1, 20, 20);
    expect(press.click(around)).toBe(one);
    expect(press.click(around), "once").toBe("as is");
  }
});

it("a press that ends elsewhere, is cancelled, or begins beside buttons clicks nothing else", () => {
  const press = createPress();
  const one = button();
  press.down(1, one, BOX);
  press.up(1, 60, 20);
  expect(press.click(panel), "dragged away").toBe("as is");
  press.down(1, one, BOX);
  press.up(2, 20, 20);
  expect(press.click(panel), "another finger").toBe("as is");
  press.down(1, one, BOX);
  press.cancel();
  expect(press.click(panel)).toBe("as is");
  press.down(1, null);
  press.up(1, 20, 20);
  expect(press.click(one)).toBe("as is");
});

it("a click on a button that was removed hits nothing in its place", () => {
  const press = createPress();
  press.down(1, button(false), BOX);
  press.up(1, 20, 20);
  expect(press.click(button())).toBe("drop");
});
