/** Requests that must not compile: path, parameters and body are those of the generated document. Type-checked only. */
import { ask } from "./client";

const uid = "";

export function mistakes(): void {
  // @ts-expect-error: there is no such path
  void ask("GET", "/servo");
  // @ts-expect-error: this path does not have the verb
  void ask("PUT", "/servos");
  // @ts-expect-error: the parameter of the path is missing
  void ask("GET", "/servos/{uid}/drift");
  // @ts-expect-error: wrong name of the parameter
  void ask("GET", "/servos/{uid}/drift", { path: { id: uid } });
  // @ts-expect-error: unknown query parameter
  void ask("GET", "/audit", { query: { lmit: 200 } });
  // @ts-expect-error: wrong type of a parameter
  void ask("GET", "/audit", { query: { limit: "many" } });
  // @ts-expect-error: the body is missing
  void ask("POST", "/servos/{uid}/torque", { path: { uid } });
  // @ts-expect-error: an unknown choice in the body
  void ask("POST", "/servos/{uid}/torque", { path: { uid }, body: { mode: "of" } });
  // @ts-expect-error: an unknown field of the body
  void ask("POST", "/servos/{uid}/torque", { path: { uid }, body: { mod: "off" } });
  // @ts-expect-error: this request has no body
  void ask("GET", "/bus", { body: {} });
  // @ts-expect-error: an unknown header
  void ask("POST", "/servos/{uid}/torque", { path: { uid }, body: { mode: "off" }, headers: { Leas: "" } });
  // @ts-expect-error: the response has another shape
  void ask("GET", "/servos").then(found => found.uid);
}
