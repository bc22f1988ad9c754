/** Lazy entry to the 3D view of a servo: its script is loaded when a page first shows it. */
import { lazy } from "../kit/lazy";

export const ViewFrame = lazy<{ uid: string }>(() => import("./live").then(file => file.ViewLive));
