/** Light, dark or auto: setting, storage and effective theme. Print is always light. */
import { computed, effect, signal } from "@preact/signals";

export type ThemeChoice = "light" | "dark" | "auto";

const KEY = "hornbill.theme";
const system = matchMedia("(prefers-color-scheme: dark)");
const systemDark = signal(system.matches);
const paper = matchMedia("print");
const onPaper = signal(paper.matches);

function stored(): ThemeChoice {
  try {
    const value = localStorage.getItem(KEY);
    return value === "light" || value === "dark" ? value : "auto";
  } catch {
    return "auto";
  }
}

export const themeChoice = signal<ThemeChoice>(stored());

export const theme = computed<"light" | "dark">(() => {
  if (onPaper.value) return "light";
  if (themeChoice.value !== "auto") return themeChoice.value;
  return systemDark.value ? "dark" : "light";
});

export function chooseTheme(next: ThemeChoice): void {
  themeChoice.value = next;
  try {
    localStorage.setItem(KEY, next);
  } catch {
    // Not stored then; it lasts until the page is reloaded.
  }
}

export function startTheme(): void {
  system.addEventListener("change", event => {
    systemDark.value = event.matches;
  });
  paper.addEventListener("change", event => {
    onPaper.value = event.matches;
  });
  effect(() => {
    document.documentElement.dataset.theme = theme.value;
  });
}
