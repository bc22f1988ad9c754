/** Light, dark or auto: setting, storage and effective theme. Print is always light. */
import { computed, effect, signal } from "@preact/signals";

export type ThemeWish = "light" | "dark" | "auto";

const KEY = "hornbill.theme";
const system = matchMedia("(prefers-color-scheme: dark)");
const systemDark = signal(system.matches);
const paper = matchMedia("print");
const onPaper = signal(paper.matches);

function kept(): ThemeWish {
  try {
    const value = localStorage.getItem(KEY);
    return value === "light" || value === "dark" ? value : "auto";
  } catch {
    return "auto";
  }
}

export const themeWish = signal<ThemeWish>(kept());

export const theme = computed<"light" | "dark">(() => {
  if (onPaper.value) return "light";
  if (themeWish.value !== "auto") return themeWish.value;
  return systemDark.value ? "dark" : "light";
});

export function chooseTheme(next: ThemeWish): void {
  themeWish.value = next;
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
