/** The Site page: every bench that shares the database, and every servo, wherever it is. It moves and stops nothing. */

import { useEffect } from "preact/hooks";
import { API, callApi } from "../api/client";
import { watchDoctor } from "../bench/doctor";
import { benches, watchSite } from "../bench/site";
import { Icon } from "../kit/icon";
import { Loaded, useResource } from "../kit/resource";
import { Scroll } from "../kit/scroll";
import { BenchTable } from "./benches";
import { DatabaseNote, DatabaseState } from "./database";
import { SiteServos } from "./servos";
import { site as words } from "./words";
import "../kit/list.css";
import "../kit/table.css";
import "./site.css";

const INVENTORY_MS = 5000;

export function SitePage() {
  const inventory = useResource(() => callApi("GET", "/inventory"), { every_ms: INVENTORY_MS });
  useEffect(() => watchSite().end, []);
  useEffect(() => watchDoctor().end, []);
  const known = benches.value.value;
  const servos = inventory.value.value;
  return (
    <div class="page list-page" data-testid="site-page">
      <div class="page-head">
        <h1>{words.title}</h1>
        {known !== null && servos !== null && (
          <span class="dim">{words.summary(known.length, servos.length)}</span>
        )}
        <DatabaseState />
        <span class="grow" />
        <a class="button" href={`${API}/inventory.csv`} download="">
          <Icon name="download" size={15} /> {words.export}
        </a>
      </div>
      <Scroll label={words.title}>
        <DatabaseNote />
        <Loaded of={benches} loading={words.loading} />
        <Loaded of={inventory} />
        <BenchTable benches={known} />
        {servos !== null && <SiteServos servos={servos} />}
      </Scroll>
    </div>
  );
}
