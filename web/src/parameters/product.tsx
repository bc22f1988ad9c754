/** Identity of a servo as facts instead of registers. */
import { catalog } from "../bench/catalog";
import { servo } from "../bench/fleet";
import { NONE } from "../bench/format";
import { modelName } from "../bench/model";
import type { Sheet } from "../bench/parameters";
import { text } from "../text";

const DATE = ["production_year", "production_month", "production_day"];
const TIME = ["production_hour", "production_minute"];

export function ProductFacts({ sheet }: { sheet: Sheet }) {
  const one = servo(sheet.uid);
  if (!one) return null;
  const strings = text.params.product;
  const rows = catalog.value?.rows;
  const held = (keys: readonly string[]) => keys.map(key => sheet.reading(key).value?.value ?? null);
  const figures = (keys: readonly string[], between: string) =>
    held(keys)
      .map(figure => String(figure).padStart(2, "0"))
      .join(between);
  const made = held([...DATE, ...TIME]).includes(null) ? NONE : `${figures(DATE, "-")} ${figures(TIME, ":")}`;
  const facts: [term: string, value: string, keys: readonly string[]][] = [
    [strings.model, modelName(one), ["model_number"]],
    [strings.serial, one.serial ?? NONE, ["product_number"]],
    [strings.firmware, one.firmware ?? NONE, ["firmware_version"]],
    [strings.hardware, String(held(["hardware_version"])[0] ?? NONE), ["hardware_version"]],
    [strings.made, made, [...DATE, ...TIME]],
    [strings.uid, one.uid, []],
  ];
  return (
    <dl class="product-facts" data-testid="product-facts">
      {facts.map(([term, value, keys]) => (
        <div key={term}>
          <dt>{term}</dt>
          <dd>{value}</dd>
          <dd class="small dim">
            {keys
              .map(key => `${rows?.get(key)?.name ?? key}: ${sheet.reading(key).value?.raw ?? NONE}`)
              .join(", ")}
          </dd>
        </div>
      ))}
    </dl>
  );
}
