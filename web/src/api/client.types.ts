/** Requests that must not compile: path, parameter and body are those of the generated document. Only ever type-checked. */
import { ask } from "./client";

const uid = "";

export function mistakes(): void {
  // @ts-expect-error: there is no such path
  void ask("GET", "/servo");
  // @ts-expect-error: this path does not know the verb
  void ask("PUT", "/servos");
  // @ts-expect-error: the parameter of the path is missing
  void ask("GET", "/servos/{uid}/drift");
  // @ts-expect-error: another name of it
  void ask("GET", "/servos/{uid}/drift", { path: { id: uid } });
  // @ts-expect-error: an unknown parameter of the query
  void ask("GET", "/audit", { query: { lmit: 200 } });
  // @ts-expect-error: a parameter of another type
  void ask("GET", "/audit", { query: { limit: "many" } });
  // @ts-expect-error: the body is missing
  void ask("POST", "/servos/{uid}/torque", { path: { uid } });
  // @ts-expect-error: an unknown choice in the body
  void ask("POST", "/servos/{uid}/torque", { path: { uid }, body: { mode: "of" } });
  // @ts-expect-error: an unknown field of the body
  void ask("POST", "/servos/{uid}/torque", { path: { uid }, body: { mod: "off" } });
  // @ts-expect-error: a body where none is read
  void ask("GET", "/bus", { body: {} });
  // @ts-expect-error: an unknown header
  void ask("POST", "/servos/{uid}/torque", { path: { uid }, body: { mode: "off" }, headers: { Leas: "" } });
  // @ts-expect-error: the answer has another shape
  void ask("GET", "/servos").then(found => found.uid);
}
