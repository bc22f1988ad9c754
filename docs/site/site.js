/** Search in what build.py wrote, and the choice of light or dark, which the page of hornbill shares. */
(() => {
  const up = document.body.dataset.up ?? "./";
  const box = document.getElementById("search");
  const found = document.getElementById("found");
  const theme = document.getElementById("theme");
  const MOST = 12;
  let loading = null;

  function load() {
    loading ??= new Promise((done) => {
      const script = document.createElement("script");
      script.src = `${up}search.js`;
      script.onload = () => done(self.searchIndex);
      script.onerror = () => done([]);
      document.head.append(script);
    });
    return loading;
  }

  function score(page, words) {
    const title = page.title.toLowerCase();
    const heads = page.headings.map(([text]) => text.toLowerCase());
    const text = page.text.toLowerCase();
    let sum = 0;
    for (const word of words) {
      const here =
        (title.includes(word) ? 20 : 0) +
        (heads.some((head) => head.includes(word)) ? 8 : 0) +
        Math.min(text.split(word).length - 1, 5);
      if (here === 0) return 0;
      sum += here;
    }
    return sum;
  }

  async function look() {
    const words = box.value.toLowerCase().split(/\s+/).filter(Boolean);
    const pages = words.length ? await load() : [];
    const best = pages
      .map((page) => [score(page, words), page])
      .filter(([points]) => points > 0)
      .sort((left, right) => right[0] - left[0])
      .slice(0, MOST);
    found.replaceChildren(
      ...best.map(([, page]) => {
        const head = page.headings.find(([text]) => words.some((word) => text.toLowerCase().includes(word)));
        const link = document.createElement("a");
        link.href = up + page.place + (head ? `#${head[1]}` : "");
        link.textContent = head ? `${page.title}: ${head[0]}` : page.title;
        const item = document.createElement("li");
        item.append(link);
        return item;
      }),
    );
    if (words.length && best.length === 0) {
      const none = document.createElement("li");
      none.textContent = "Nothing found.";
      found.append(none);
    }
    found.hidden = words.length === 0;
  }

  box.hidden = false;
  box.addEventListener("input", look);
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") {
      box.value = "";
      found.hidden = true;
    }
    if (event.key === "/" && document.activeElement !== box) {
      event.preventDefault();
      box.focus();
    }
  });

  // Only where a browser lets a page write: on this machine, or over https.
  if (navigator.clipboard) {
    for (const code of document.querySelectorAll("pre")) {
      const copy = document.createElement("button");
      copy.type = "button";
      copy.textContent = "Copy";
      copy.addEventListener("click", async () => {
        await navigator.clipboard.writeText(code.textContent.trimEnd());
        copy.textContent = "Copied";
        setTimeout(() => {
          copy.textContent = "Copy";
        }, 2000);
      });
      const block = document.createElement("div");
      block.className = "block";
      code.replaceWith(block);
      block.append(code, copy);
    }
  }

  theme.hidden = false;
  theme.addEventListener("click", () => {
    const next = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
    document.documentElement.dataset.theme = next;
    try {
      localStorage.setItem("hornbill.theme", next);
    } catch {
      // Storage may be forbidden; the choice then lasts as long as this page.
    }
  });
})();
