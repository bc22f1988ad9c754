/** The door to the 3D view of a servo: its script comes when a page first shows it. */
import { lazy } from "../ui/lazy";

export const ViewFrame = lazy<{ uid: string }>(() => import("./view-live").then(file => file.ViewLive));
