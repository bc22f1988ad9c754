/** Owns where a servo of the wall of horns is in its picture: the camera of the 3D view, and rows that fill the frame. */

/** As in hornbill/view/layout.py; a test there compares them. Scene units; the camera looks at the middle, z is up. */
export const CAMERA = [0, -8, 13.9] as const;
export const FOV_DEG = 24;
export const PITCH = [3.8, 4.8] as const;

/** A horn that points away reaches so much further up the picture than its servo reaches down: the place follows. */
const BACK = 0.5;
/** The largest a servo is drawn. */
const LARGEST = 1.2;
const MOST_COLUMNS = 24;

export interface Size {
  width: number;
  height: number;
}

export interface Rows {
  columns: number;
  rows: number;
  scale: number;
}

/** A part of the picture, px. */
export interface Box {
  left: number;
  top: number;
  width: number;
  height: number;
}

const DISTANCE = Math.hypot(...CAMERA);
const [FORWARD_Y, FORWARD_Z] = [-CAMERA[1] / DISTANCE, -CAMERA[2] / DISTANCE];

/** Where a point of the scene is in a picture of this size, px from its top left. */
export function project(x: number, y: number, z: number, size: Size): { x: number; y: number } {
  const focal = size.height / 2 / Math.tan((FOV_DEG * Math.PI) / 360);
  const [dy, dz] = [y - CAMERA[1], z - CAMERA[2]];
  const depth = dy * FORWARD_Y + dz * FORWARD_Z;
  const above = dy * -FORWARD_Z + dz * FORWARD_Y;
  return { x: size.width / 2 + (focal * x) / depth, y: size.height / 2 - (focal * above) / depth };
}

/** How many columns show `count` servos largest in a picture of this size, with `margin` px left at every side. */
export function fill(count: number, size: Size, margin = 8): Rows {
  let best: Rows = { columns: 1, rows: Math.max(1, count), scale: 0.01 };
  for (let columns = 1; columns <= Math.min(Math.max(count, 1), MOST_COLUMNS); columns++) {
    const rows = Math.max(1, Math.ceil(count / columns));
    let [low, high] = [0.01, LARGEST];
    for (let step = 0; step < 16; step++) {
      const scale = (low + high) / 2;
      if (fits({ columns, rows, scale }, size, margin)) low = scale;
      else high = scale;
    }
    if (low > best.scale * 1.001) best = { columns, rows, scale: low };
  }
  return best;
}

function fits(wall: Rows, size: Size, margin: number): boolean {
  const across = (wall.columns * PITCH[0] * wall.scale) / 2;
  const along = (wall.rows * PITCH[1] * wall.scale) / 2;
  const back = project(across, along + BACK * wall.scale, 0, size);
  const front = project(across, -along + BACK * wall.scale, 0, size);
  const right = size.width - margin;
  return back.y >= margin && front.y <= size.height - margin && front.x <= right && back.x <= right;
}

/** The part of the picture that belongs to the servo at this place, counted from the back left. */
export function boxOf(index: number, wall: Rows, size: Size): Box {
  const [row, column] = [Math.floor(index / wall.columns), index % wall.columns];
  const [across, along] = [PITCH[0] * wall.scale, PITCH[1] * wall.scale];
  const x = (column - (wall.columns - 1) / 2) * across;
  const y = ((wall.rows - 1) / 2 - row) * along;
  const top = project(x, y + along / 2 + BACK * wall.scale, 0, size).y;
  const left = project(x - across / 2, y, 0, size).x;
  const right = project(x + across / 2, y, 0, size).x;
  return {
    left,
    top,
    width: right - left,
    height: project(x, y - along / 2 + BACK * wall.scale, 0, size).y - top,
  };
}
