/** Forecast of the horn at a restart: a dial with the path, the sentence, the reason, and warnings. */
import type { ComponentChildren } from "preact";
import type { Forecast, ForecastWarning } from "../api/config-types";
import { now } from "../bench/clock";
import { angleOf, type KnownServo } from "../bench/fleet";
import { angle, number, withUnit } from "../bench/format";
import { limitsOf } from "../bench/servo-condition";
import { Dial } from "../kit/dial";
import { Glyph } from "../kit/glyph";
import { changing as words } from "./words";

interface Props {
  one: KnownServo;
  forecast: Forecast;
  verb: "save" | "restart" | "factory-reset";
  /** Further sentences below. */
  children?: ComponentChildren;
}

export function HornForecast({ one, forecast, verb, children }: Props) {
  const goes = forecast.code === "moves" && forecast.to_deg !== null;
  return (
    <div class="what-moves" data-testid="horn-forecast" data-code={forecast.code}>
      <Dial
        size={140}
        angle={angleOf(one, now.value).value}
        limits={limitsOf(one.uid)}
        {...(goes ? { goesTo: forecast.to_deg ?? 0 } : {})}
      />
      <div>
        <h3>{hornLine(forecast)}</h3>
        <p class="second">
          {words.gap[verb]} {words.after[forecast.code]}
        </p>
        {forecast.coded_warnings.flatMap(each => {
          const line = warned(each, verb);
          return line === null ? [] : [<Warned key={each.code} line={line} />];
        })}
        {children}
      </div>
    </div>
  );
}

function Warned({ line }: { line: string }) {
  return (
    <p class="warned">
      <Glyph kind="warning" size={15} /> <span>{line}</span>
    </p>
  );
}

/** Movement of the horn, in one line. */
export function hornLine(forecast: Forecast): string {
  return forecast.code === "moves" ? words.horn.moves(angle(forecast.from_deg)) : words.horn[forecast.code];
}

/** Covered by the sentence about the horn. */
const SAID = new Set(["load_may_drop", "no_torque_after_start"]);

function warned(warning: ForecastWarning, verb: Props["verb"]): string | null {
  const { code, params } = warning;
  // A restart alone does not write ROM: warnings on the supply concern writing it.
  if (SAID.has(code) || (verb === "restart" && code.startsWith("supply_"))) return null;
  const volts = (name: string) => withUnit(number(params[name] ?? 0, 1), "V");
  switch (code) {
    case "turn_count_lost":
      return words.warnings.turn_count_lost(
        angle(params.before_deg ?? null),
        angle(params.after_deg ?? null),
      );
    case "rom_lost":
      return words.warnings.rom_lost();
    case "timeout_during_soft_start":
      return words.warnings.timeout_during_soft_start(withUnit(number(params.after_s ?? 0, 1), "s"));
    case "energised":
      return words.warnings.energised();
    case "outside_limits":
      return words.warnings.outside_limits(angle(params.angle_deg ?? null), angle(params.limit_deg ?? null));
    case "supply_near_limit":
      return words.warnings.supply_near_limit(volts("supply_v"), volts("limit_v"));
    case "supply_unknown":
      return words.warnings.supply_unknown();
    case "supply_beyond_limit":
      return words.warnings.supply_beyond_limit(volts("supply_v"));
    default:
      return warning.text;
  }
}
