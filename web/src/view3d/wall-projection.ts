/** Projection of the wall of horns: the camera of the 3D view, and rows that fill the frame. */

/** As in hornbill/view/layout.py; a test there compares them. Scene units; the camera points at the centre, z is up. */
export const CAMERA = [0, -8, 13.9] as const;
export const FOV_DEG = 24;
export const PITCH = [3.8, 4.8] as const;

/** Distance by which rows are closer to the camera than the centre, unscaled. */
export const NEARER = 0.8;

/** Reach of limit arcs from the shaft and their height above the floor, unscaled: the outermost parts. */
export const ARC = 1.57;
export const TALL = 2.19;
/** Distance from the shaft to the front of a case, and to its ears at the left. */
const FRONT = 0.55;
const EARS = 1.86;
/** Space below the front row for a name and an angle. */
const NAME_PX = 38;
/** Maximum size of a servo. */
const LARGEST = 1.2;
const MOST_COLUMNS = 24;

export interface Size {
  width: number;
  height: number;
}

export interface WallRows {
  columns: number;
  rows: number;
  scale: number;
}

/** A part of the picture, px. */
export interface PictureBox {
  left: number;
  top: number;
  width: number;
  height: number;
}

const DISTANCE = Math.hypot(...CAMERA);
const [FORWARD_Y, FORWARD_Z] = [-CAMERA[1] / DISTANCE, -CAMERA[2] / DISTANCE];

/** Position of a scene point in a picture of this size, px from its top left. */
export function project(x: number, y: number, z: number, size: Size): { x: number; y: number } {
  const focal = size.height / 2 / Math.tan((FOV_DEG * Math.PI) / 360);
  const [dy, dz] = [y - CAMERA[1], z - CAMERA[2]];
  const depth = dy * FORWARD_Y + dz * FORWARD_Z;
  const above = dy * -FORWARD_Z + dz * FORWARD_Y;
  return { x: size.width / 2 + (focal * x) / depth, y: size.height / 2 - (focal * above) / depth };
}

/** Number of columns that shows `count` servos largest in a picture of this size, with `margin` px at every side. */
export function fill(count: number, size: Size, margin = 8): WallRows {
  let best: WallRows = { columns: 1, rows: Math.max(1, count), scale: 0.01 };
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

function fits(wall: WallRows, size: Size, margin: number): boolean {
  const { columns, rows, scale } = wall;
  const aside = ((columns - 1) / 2) * PITCH[0] * scale;
  const near = placeOf(rows - 1, wall);
  const left = project(-aside - EARS * scale, near, TALL * scale, size).x;
  const right = project(aside + ARC * scale, near, TALL * scale, size).x;
  const front = edge(rows, wall, size);
  return (
    edge(0, wall, size) >= margin &&
    front <= size.height - margin &&
    left >= margin &&
    right <= size.width - margin
  );
}

/** Positions of the shafts of a row, counted from the back. */
function placeOf(row: number, wall: WallRows): number {
  return (((wall.rows - 1) / 2 - row) * PITCH[1] - NEARER) * wall.scale;
}

/** Boundary between two rows in the picture: the highest reach of the nearer row; below the last row, its names. */
function edge(row: number, wall: WallRows, size: Size): number {
  const { rows, scale } = wall;
  if (row < rows) return project(0, placeOf(row, wall) + ARC * scale, TALL * scale, size).y;
  const last = placeOf(rows - 1, wall);
  const foot = project(0, last - FRONT * scale, 0, size).y;
  const arc = project(0, last - ARC * scale, TALL * scale, size).y;
  return Math.max(foot, arc) + NAME_PX;
}

/** Part of the picture of the servo at this place, counted from the back left. */
export function boxOf(index: number, wall: WallRows, size: Size): PictureBox {
  const [row, column] = [Math.floor(index / wall.columns), index % wall.columns];
  const across = PITCH[0] * wall.scale;
  const x = (column - (wall.columns - 1) / 2) * across;
  const y = placeOf(row, wall);
  const top = edge(row, wall, size);
  const left = project(x - across / 2, y, 0, size).x;
  const right = project(x + across / 2, y, 0, size).x;
  return { left, top, width: right - left, height: edge(row + 1, wall, size) - top };
}
