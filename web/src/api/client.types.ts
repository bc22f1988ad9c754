/** Requests that must not compile: path, parameters and body are those of the generated document. Type-checked only. */
import { callApi } from "./client";

const uid = "";

export function mistakes(): void {
  // @ts-expect-error: there is no such path
  void callApi("GET", "/servo");
  // @ts-expect-error: this path does not have the verb
  void callApi("PUT", "/servos");
  // @ts-expect-error: the parameter of the path is missing
  void callApi("GET", "/servos/{uid}/drift");
  // @ts-expect-error: wrong name of the parameter
  void callApi("GET", "/servos/{uid}/drift", { path: { id: uid } });
  // @ts-expect-error: unknown query parameter
  void callApi("GET", "/audit", { query: { lmit: 200 } });
  // @ts-expect-error: wrong type of a parameter
  void callApi("GET", "/audit", { query: { limit: "many" } });
  // @ts-expect-error: the body is missing
  void callApi("POST", "/servos/{uid}/torque", { path: { uid } });
  // @ts-expect-error: an unknown choice in the body
  void callApi("POST", "/servos/{uid}/torque", { path: { uid }, body: { mode: "of" } });
  // @ts-expect-error: an unknown field of the body
  void callApi("POST", "/servos/{uid}/torque", { path: { uid }, body: { mod: "off" } });
  // @ts-expect-error: this request has no body
  void callApi("GET", "/bus", { body: {} });
  const addressed = { path: { uid }, body: { mode: "off" } } as const;
  // @ts-expect-error: an unknown header
  void callApi("POST", "/servos/{uid}/torque", { ...addressed, headers: { Leas: "" } });
  // @ts-expect-error: the response has another shape
  void callApi("GET", "/servos").then(found => found.uid);
}
