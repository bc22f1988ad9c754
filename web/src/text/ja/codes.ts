/** Japanese texts for the server's codes: events, marks of recordings, notes, cautions, errors. */
import type { Codes } from "../../bench/codes";
import { live } from "../../motion/text.ja";
import { cautions } from "./cautions";
import { happened, marks } from "./events";
import { notes } from "./notes";
import { causes, codes as problems, who } from "./problems";
import { verdicts } from "./verdicts";

export const codes: Codes = {
  happened,
  marks,
  notes,
  verdicts,
  cautions,
  causes,
  problem(problem, facts) {
    if (problem.code === "lease_held")
      return live.motion.heldBy(who(facts.holder), problem.facts.expires_in_s);
    const sentence = (causes[facts.cause ?? ""] ?? problems[problem.code])?.(facts) ?? problem.message;
    return (
      sentence +
      (facts.also ?? "")
        .split("、")
        .map(one => causes[one]?.(facts) ?? "")
        .join("")
    );
  },
};
