// Letters of a view that would lie on each other, or beyond its edge, are moved aside on the screen.
import { Vector3 } from "three";

const [ROUNDS, GAP] = [12, 2];
// Of the view's name above and its buttons below [pixels].
const [ABOVE, BELOW] = [28, 46];
const [place, size] = [new Vector3(), new Vector3()];

// letters: sprites whose size does not depend on their distance; width and height of the view [pixels].
export function spread(letters, camera, width, height) {
  const boxes = letters.map((sprite) => box(sprite, camera, width, height));
  for (let round = 0; round < ROUNDS; round++) {
    boxes.forEach((a, i) => boxes.slice(i + 1).forEach((b) => part(a, b)));
    for (const one of boxes) {
      one.x = within(one.x, one.across, 0, width);
      one.y = within(one.y, one.tall, ABOVE, height - BELOW);
    }
  }
  boxes.forEach((one, i) => letters[i].center.set(0.5 - (one.x - one.own[0]) / one.across, 0.5 + (one.y - one.own[1]) / one.up));
}

// Its middle on the screen, x to the right and y down, and its size there.
function box(sprite, camera, width, height) {
  sprite.getWorldPosition(place).project(camera);
  sprite.getWorldScale(size);
  const pixels = (camera.projectionMatrix.elements[5] * height) / 2;
  const own = [((place.x + 1) / 2) * width, ((1 - place.y) / 2) * height];
  // The letters fill two thirds of their sprite's height.
  return { own, x: own[0], y: own[1], across: size.x * pixels, up: size.y * pixels, tall: 0.66 * size.y * pixels };
}

// Each half the way, across or up, whichever is shorter.
function part(a, b) {
  const across = (a.across + b.across) / 2 + GAP - Math.abs(a.x - b.x);
  const up = (a.tall + b.tall) / 2 + GAP - Math.abs(a.y - b.y);
  if (across <= 0 || up <= 0) return;
  if (up <= across) {
    const side = a.y <= b.y ? 1 : -1;
    a.y -= (side * up) / 2;
    b.y += (side * up) / 2;
  } else {
    const side = a.x <= b.x ? 1 : -1;
    a.x -= (side * across) / 2;
    b.x += (side * across) / 2;
  }
}

function within(middle, extent, from, to) {
  return Math.min(Math.max(middle, from + extent / 2), to - extent / 2);
}
