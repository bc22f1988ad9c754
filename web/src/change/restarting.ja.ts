/** Japanese words of the dialogs before a restart and a factory reset, and of their progress; loaded with them. */
import type { Topics } from "../text/language";

export const words = {
  gap: {
    save: "ROMに書き込んで再起動します。約1秒間トルクがなく、負荷が落ちることがあります。",
    restart: "約1秒間トルクがなく、負荷が落ちることがあります。",
    "factory-reset": "まずトルクをオフにします。数秒間トルクがなく、負荷が落ちることがあります。",
  },
  horn: {
    moves: from => `ホーンが動きます: ${from}から0.0°へ`,
    unknown_start: "ホーンが0.0°へ動きます",
    stays: "ホーンは0.0°のままです",
    holds: "ホーンは動きません",
    no_torque: "サーボはトルクオフで再起動します",
    brake: "サーボはブレーキで再起動します",
    unknown: "ホーンが0.0°へ動くことがあります",
  },
  after: {
    moves: "その後、最大30\u202frpm、トルク30\u202f%でゆっくり0.0°へ動きます。",
    unknown_start:
      "その後、ゆっくり0.0°へ動きます。再起動で原点または回転方向が変わるため、始めの角度は不明です。",
    stays: "その後、0.0°から1°以内で保持します。",
    holds: "ソフトスタートはオフのため、その後は今の位置を保持します。",
    no_torque: "再起動後、トルクをオンにするまで何も保持しません。",
    brake: "再起動後は弱いブレーキだけで、角度を保持しません。",
    unknown: "ROMをすべて読み出していないため、その後のホーンの動きは不明です。",
  },
  warnings: {
    turn_count_lost: (before, after) =>
      `回転数が失われます: ${before}は${after}になります。次の動作は逆向きになることがあります。`,
    rom_lost: () =>
      "前回の起動で保存値を読み込めませんでした。今回も読み込めなければ、再び初期値で動きます。スナップショットを復元して保存してください。",
    timeout_on_the_way: after =>
      `起動から${after}で通信タイムアウト（0x26、0x27）により出力がオフになり、ホーンが惰性で動くことがあります。`,
    energised: () =>
      "ROMの書き込み直前に出力が一瞬オンになり、ホーンを今の位置で保持します。手を触れないでください。",
    outside_limits: (here, limit) =>
      `ホーンは${here}にあり、動作制限角度の範囲外です。${limit}まで動くことがあります。`,
    supply_near_limit: (supply, limit) =>
      `電源電圧は${supply}で、制限の${limit}に近い値です。ROMの書き込み中に下がらないようにしてください。`,
    supply_unknown: () => "電源電圧を読み出していません。ROMの書き込み中は安定した電源が必要です。",
    supply_beyond_limit: supply =>
      `電源電圧は${supply}で、再起動後の制限を外れます。その場合、出力はオフのままです。`,
  },
  facts: (model, serial, id) => `${model}、${serial}、サーボ${id}`,
  refused: why => `今は実行できません。${why}`,
  planning: "確認中",
  restart: {
    title: name => `${name}を再起動しますか？`,
    titleAll: n => `${n}台のサーボを再起動しますか？`,
    inTurn: "この順に1台ずつ再起動します。最後の1台が終わるまで、このページを開いておいてください。",
    lost: n => `RAMのみの${n}件の値が失われます`,
    lostHint: "残すには、取り消して先にROMに保存してください。",
    nothingLost: "失われる値はありません。RAMの値は確認済みのROMの値と同じです。",
    head: { parameter: "パラメーター", ram: "今のRAM", rom: "再起動後（ROM）" },
    table: { servo: "サーボ", horn: "ホーン", lost: "失われるRAMの値" },
    none: "なし",
    leftOut: "対象外",
    go: name => `${name}を再起動`,
    goAll: n => `${n}台を再起動`,
  },
  reset: {
    title: name => `${name}を初期化しますか？`,
    keep: (id, node, origin) => `サーボID ${id}、${node}、原点 ${origin}を残す`,
    node: id => `ノードID ${id}`,
    dynamicNode: "動的ノードID",
    identityGoes:
      "サーボIDは0、ノードIDは動的になり、原点も変わることがあります。サーボは固有IDで再び見つかります。",
    changes: n => `RAMとROMの${n}件の値が変わります`,
    nothing: "すべて初期値ですが、書き込んで再起動します。",
    head: { parameter: "パラメーター", now: "現在", next: "初期値" },
    snapshot: "先に現在の値のスナップショットを取ります。",
    type: name => `確認のため「${name}」と入力`,
    go: name => `${name}を初期化`,
  },
  run: {
    title: {
      restart: { one: name => `${name}を再起動中`, all: n => `${n}台を再起動中` },
      "factory-reset": { one: name => `${name}を初期化中`, all: n => `${n}台を初期化中` },
    },
    done: {
      restart: { one: name => `${name}を再起動しました`, all: n => `${n}台を再起動しました` },
      "factory-reset": { one: name => `${name}を初期化しました`, all: n => `${n}台を初期化しました` },
    },
    failed: {
      restart: {
        one: name => `${name}の再起動を確認できません`,
        all: n => `${n}台は再起動していません`,
      },
      "factory-reset": {
        one: name => `${name}は初期化できませんでした`,
        all: n => `${n}台は初期化できませんでした`,
      },
    },
    keepOn: "終わるまで電源を切らないでください。",
    of: (done, all) => `${done} / ${all}台完了`,
    state: {
      waiting: "待機中",
      running: "実行中",
      done: "完了",
      failed: "失敗",
      left_out: "未開始",
    },
    steps: name => `${name}の手順`,
  },
} satisfies Topics["restarting"];
