/** Help of rows and tabs in the page's language, or the server's. */
import type { Row } from "../api/types";
import type { Tab } from "./catalog";
import { help } from "./words";

export const aboutRow = (row: Row) => help.rows[row.key] ?? row.description;

export const aboutTab = (tab: Tab) => help.groups[tab.key] ?? tab.description;

/** The maker's advice on a row, if any. */
export const adviceOn = (row: Row) => help.advice[row.key] ?? row.advice;
