/** What the API page reads of the OpenAPI document: its operations, flat, and which of them match a search. */

export interface Argument {
  name: string;
  where: string;
  type: string;
  required: boolean;
  what: string;
}

export interface Answer {
  status: string;
  what: string;
}

export interface Operation {
  verb: string;
  path: string;
  tag: string;
  summary: string;
  arguments: readonly Argument[];
  /** The name of the body's shape, or null without a body. */
  body: string | null;
  answers: readonly Answer[];
}

interface Schema {
  $ref?: string;
  type?: string;
  anyOf?: Schema[];
  oneOf?: Schema[];
  items?: Schema;
  enum?: unknown[];
  minimum?: number;
  maximum?: number;
  default?: unknown;
}

interface Documented {
  summary?: string;
  description?: string;
  tags?: string[];
  parameters?: (Parameter | Reference)[];
  requestBody?: { content: Record<string, { schema?: Schema }> };
  responses: Record<string, { description?: string } | Reference>;
}

interface Parameter {
  name: string;
  in: string;
  required?: boolean;
  description?: string;
  schema?: Schema;
}

/** To what several operations share, declared once under `components`. */
interface Reference {
  $ref: string;
  description?: string;
}

export interface OpenApi {
  paths: Record<string, Record<string, Documented>>;
  components?: {
    parameters?: Record<string, Parameter>;
    responses?: Record<string, { description?: string }>;
  };
}

const nameOf = (reference: Reference): string => reference.$ref.slice(reference.$ref.lastIndexOf("/") + 1);

/** "integer 1 to 254", "array of Servo", "on | off": a shape in a word or few. */
export function typeOf(schema: Schema | undefined, list: (of: string) => string): string {
  if (!schema) return "";
  if (schema.$ref) return nameOf({ $ref: schema.$ref });
  const several = (schema.anyOf ?? schema.oneOf)?.filter(one => one.type !== "null");
  if (several) return several.map(one => typeOf(one, list)).join(" | ");
  if (schema.enum) return schema.enum.map(String).join(" | ");
  if (schema.type === "array") return list(typeOf(schema.items, list));
  const range =
    schema.minimum === undefined && schema.maximum === undefined
      ? ""
      : ` ${schema.minimum ?? ""}…${schema.maximum ?? ""}`;
  return `${schema.type ?? ""}${range}`;
}

function parameterOf(found: OpenApi, given: Parameter | Reference): Parameter[] {
  if (!("$ref" in given)) return [given];
  const shared = found.components?.parameters?.[nameOf(given)];
  return shared ? [shared] : [];
}

function descriptionOf(found: OpenApi, answer: { description?: string } | Reference): string {
  const shared = "$ref" in answer ? found.components?.responses?.[nameOf(answer)]?.description : undefined;
  return answer.description ?? shared ?? "";
}

const VERBS = ["get", "put", "post", "patch", "delete"];

/** Every operation, in the order of the paths. */
export function operationsOf(found: OpenApi, list: (of: string) => string): Operation[] {
  return Object.entries(found.paths).flatMap(([path, verbs]) =>
    VERBS.filter(verb => verb in verbs).map(verb => {
      const one = verbs[verb] as Documented;
      const content = Object.entries(one.requestBody?.content ?? {});
      return {
        verb: verb.toUpperCase(),
        path,
        tag: one.tags?.[0] ?? "",
        summary: one.description ?? one.summary ?? "",
        arguments: (one.parameters ?? [])
          .flatMap(given => parameterOf(found, given))
          .map(argument => ({
            name: argument.name,
            where: argument.in,
            type: typeOf(argument.schema, list),
            required: argument.required ?? false,
            what: argument.description ?? "",
          })),
        body: content[0] ? typeOf(content[0][1].schema, list) || content[0][0] : null,
        answers: Object.entries(one.responses).map(([status, answer]) => ({
          status,
          what: descriptionOf(found, answer).replaceAll("`", ""),
        })),
      };
    }),
  );
}

/** Those in which every word of the search stands: in verb, path, tag, or what it does. */
export function matching(operations: readonly Operation[], search: string): Operation[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  return operations.filter(one => {
    const whole = `${one.verb} ${one.path} ${one.tag} ${one.summary}`.toLowerCase();
    return words.every(word => whole.includes(word));
  });
}
