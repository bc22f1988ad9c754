/** The door to the 3D view of a servo: its script comes when a page first shows it. */
import { lazy } from "../kit/lazy";

export const ViewFrame = lazy<{ uid: string }>(() => import("./live").then(file => file.ViewLive));
