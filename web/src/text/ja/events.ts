/** What happened, in Japanese, by code: the lines of the event log, and what a recording was written for. tests/contract holds it complete. */
import type { RefusalCode } from "../../api/types";
import type { Codes } from "../../bench/codes";
import type { Facts, FactsText } from "../../bench/facts";
import { notes } from "./notes";
import { because, LEASE_END, STOP_CAUSE, UNIT, who } from "./said";
import { table } from "./table";

const DISK = "データフォルダとディスクを確認してください。";
const CUT = "動く可能性があれば電源を切ってください。";
const MODE: Readonly<Record<string, string>> = { on: "オン", off: "オフ", brake: "ブレーキ" };

const mode = (p: Facts) => MODE[p.mode ?? ""] ?? p.mode ?? "";
const trouble = (p: Facts) =>
  p.problem ?? `${p.address}を使用できません。アダプタとケーブルを確認してください。`;
const again = (p: Facts) => (p.retry ? "自動で開き直します。" : "");
const faultNames = (keys: string | undefined) =>
  (keys ?? "")
    .split("、")
    .map(key => faultName(key))
    .join("、");
const faultName = (key: string | undefined) =>
  (table.faults as Readonly<Record<string, string>>)[key ?? ""] ?? key ?? "";
const faultAdvice = (key: string | undefined) =>
  (table.advice as Readonly<Record<string, string>>)[key ?? ""] ?? "";

/** What cannot be stored. */
const UNSTORED: Readonly<Record<string, string>> = {
  audit: `監査記録を保存できません。${DISK}今行っている操作は記録されません。`,
  faults: `異常の履歴を保存できません。${DISK}異常は表示されます。`,
  changes: `今の変更は保存されません。サーバを再起動すると失われます。${DISK}`,
  stop: `停止状態を保存できません。今は有効ですが、サーバを再起動すると引き継がれません。${DISK}`,
  lost_values: `サーボが失ったRAMの値を保存できませんでした。${DISK}`,
  position_unit: `位置の単位を保存できませんでした。${DISK}`,
};

/** What a node ID cannot be given for. */
export const refusals = {
  table_failed: () => "割り当て表を読み書きできません。データフォルダを確認してください。",
  pinned_id_in_use: p => `固定されたノードID ${p.node_id}を別のノードが使っています。`,
  all_taken: p =>
    `${p.node_ids}個のノードIDがすべて使用中です。使われていないノードの割り当てを削除してください。`,
} satisfies Partial<Record<RefusalCode, FactsText>>;

/** Why a recording is written. */
export const marks = {
  stop: p => `${who(p.by)}が停止${p.why ? `: ${STOP_CAUSE[p.why] ?? p.why}` : ""}`,
  failure: p => `${p.servo}の障害: ${faultNames(p.faults)}`,
  lost: p =>
    p.node_id === undefined
      ? `${p.servo}がオフライン`
      : `${p.servo}のノードID ${p.node_id}を別のノードが使用`,
  bus_lost: p => trouble(p).replace(/。$/, ""),
} satisfies Codes["marks"];

export const happened = {
  connected: p => `${p.address}に${p.mbit_per_s}\u202fMbit/sで接続しました。`,
  disconnected: p => `${p.address}から切断しました。`,
  bus_lost: p =>
    `${trouble(p)}${again(p)}${
      p.servos ? `指令は終了しました。バスが戻ると${p.servos}のトルクはオフになります。それまで、${CUT}` : ""
    }`,
  bus_trouble: trouble,
  bus_back: p =>
    `${p.address}が${p.away_s}後に戻りました。自動では何も動きません。${
      p.servos ? `${p.servos}のトルクはオフになります。` : ""
    }`,
  commanded_elsewhere: p => `ノード${p.node_id}が${p.servo}を指令しています。`,
  command_lost: p =>
    `ノード${p.node_id}から${p.servo}への指令が、タイムアウト（0x27）の${p.timeout_s}より長く途絶えました。${
      {
        on: "サーボは最後の指令を保持します",
        off: "サーボは出力をオフにします",
        brake: "サーボはブレーキをかけます",
      }[p.action ?? ""] ?? "サーボは設定どおりに動作します"
    }（0x26）。`,
  motion_yielded: p =>
    `${p.servo}をノード${p.node_id}が指令し始めたため、hornbillは指令を終えました。トルクはそのままです。`,
  sample_point: p =>
    `${p.address}のサンプルポイントは${p.sample_point_pct}、サーボは${p.wanted_sample_point_pct}です。短いバスでは使えますが、長いバスではアダプタを合わせてください。`,

  allocator_mode: p =>
    `ノードIDのアロケータを「${{ on: "オン", off: "オフ", force: "強制" }[p.mode ?? ""] ?? p.mode}」にしました。`,
  allocated: p => `ノードID ${p.node_id}を${p.uid?.slice(0, 8)}…に割り当てました。`,
  node_ids_freed: p => `${p.idle_s}以上検出されないノードのID ${p.count}件を空けました。`,
  node_id_recycled: p =>
    `空きがないため、1か月検出されない${p.uid}のノードID ${p.node_id}を新しいノードに割り当てました。`,
  no_node_id: p =>
    `${p.uid}にノードIDを割り当てられません。${refusals[(p.refusal ?? "") as keyof typeof refusals]?.(p) ?? ""}`,
  second_allocator: p =>
    `ノード${p.node_id}もノードIDを割り当てています。${
      {
        on: "設定どおりhornbillも割り当てを続けます。",
        off: "hornbill側はオフです。",
        standby: "hornbillは控えています。",
      }[p.allocator ?? ""] ?? ""
    }`,
  second_allocator_gone: p =>
    `ノード${p.node_id}の割り当てはなくなりました。${p.allocator === "on" ? "hornbillが割り当てを再開します。" : ""}`,
  own_node_id: p =>
    `${p.makers_program ? "Futabaの設定ソフト" : "別のプログラム"}がhornbillのノードID ${p.node_id}を使っています。${
      {
        on: "設定どおりhornbillはノードIDの割り当てを続けます。",
        off: "hornbillのアロケータはオフです。",
        standby: `相手の最後のフレームから${p.shared_s}の間、hornbillはノードIDを割り当てません。`,
      }[p.allocator ?? ""] ?? ""
    }どちらかのプログラムを終了してください。`,
  own_node_id_alone: p =>
    `ノードID ${p.node_id}は再びhornbillだけが使っています。${p.allocator === "on" ? "ノードIDの割り当てを再開します。" : ""}`,

  ready: p => `${p.servo}をノード${p.node_id}で検出しました。`,
  offline: p =>
    p.node_id === undefined
      ? `${p.servo}の通信が途絶えました。${p.lag_s ? `このコンピュータが混み合い、処理が最大${p.lag_s}遅れたため、受信漏れの可能性があります。` : ""}`
      : `${p.servo}がいなくなりました。ノードID ${p.node_id}を別のノードが使っています。`,
  restarted: p =>
    `${p.servo}が自ら再起動しました。RAMだけの値は失われました。ホーンがソフトスタートで0°へ動くことがあります。`,
  fault: p => `${p.servo}: ${faultName(p.fault)}。${faultAdvice(p.fault)}`,
  fault_cleared: p => `${p.servo}: 「${faultName(p.fault)}」は解消しました。`,
  hunting: p =>
    `${p.servo}が停止位置で${p.peak_to_peak_deg}（全振幅）振動しています（ハンチング）。角度比例ゲインを下げるか、微分ゲインを上げるか、デッドバンドを広げてください。`,
  hunting_ended: p => `${p.servo}の停止位置での振動は収まりました。`,
  saturated: p =>
    `${p.servo}は停止したままトルク${p.torque_pct}で、制限の${p.torque_limit_pct}に近い状態です。ホーンの拘束や過大な負荷を確認してください。`,
  saturated_ended: p => `${p.servo}のトルクは制限から離れました。`,
  turns_lost: p => `${p.servo}は${p.angle_deg}で再起動し、回転数を失いました（4.1）。`,
  drift: p =>
    `${p.servo}が前回の記録と異なります: ${[
      p.keys,
      p.firmware_before && `ファームウェア${p.firmware_before} → ${p.firmware}`,
    ]
      .filter(Boolean)
      .join("、")}。${p.keys ? "元の値に戻すか、今の値を受け入れてください。" : ""}`,
  ram_values_lost: p =>
    `${p.servo}が再起動し、RAMだけにあった${p.count}件の値を失いました: ${p.keys}。もう一度適用してください。`,
  position_unit: p =>
    ({
      other_firmware: `${p.servo}のファームウェアが位置の単位を測定したときと異なるため、測定し直します。`,
      unclear: `${p.servo}の位置の単位が不明です。角度は0x08から読み、ArrayCommandでは角度を送りません。`,
      forced_otherwise: `${p.servo}の位置の単位は${UNIT[p.unit ?? ""] ?? p.unit}に指定されていますが、${UNIT[p.measured ?? ""] ?? p.measured}のようです。`,
      another: `${p.servo}の位置の単位は${UNIT[p.unit ?? ""] ?? p.unit}ではなく${UNIT[p.measured ?? ""] ?? p.measured}です。角度はその単位で表示し、ArrayCommandでは角度を送りません。`,
    })[p.what ?? ""] ?? `${p.servo}の位置の単位が変わりました。`,
  not_rolled_back: p =>
    p.servo === undefined
      ? `元に戻せなかったIDがあります: ${p.ids}。これらのサーボを読み出し、IDを書き直してください。`
      : `${p.servo}を元に戻せませんでした: ${p.keys}。読み出して、最後のスナップショットを復元してください。`,
  not_restored: p =>
    `${p.servo}の一時的な値をまだ元に戻せません: ${p.keys}。RAMだけの値です。サーボが応答すると自動で戻します。サーボを再起動しても戻ります。`,
  restored_later: p => `${p.servo}の一時的な値を元に戻し、確認しました: ${p.keys}。`,

  lease_requested: p =>
    `${who(p.by)}が${who(p.holder)}に動作権を求めています${because(p)}拒否しなければ${p.timeout_s}後に移ります。`,
  lease_withdrawn: p =>
    p.gone
      ? `動作権を求めていた${who(p.by)}がいなくなりました。`
      : `${who(p.by)}が動作権の要求を取り消しました。`,
  lease_refused: p =>
    p.forced
      ? `${who(p.holder)}が動作権を強制的に取りました。${who(p.by)}の要求は終わりです。`
      : `${who(p.holder)}が動作権を渡しませんでした。要求者は${who(p.by)}です。`,
  lease_passed: p =>
    `${who(p.by)}が${p.holder === undefined ? "" : `${who(p.holder)}から`}動作権を受け取りました${because(p)}`,
  lease_forced: p =>
    `${who(p.by)}が${p.holder === undefined ? "" : `${who(p.holder)}から`}動作権を強制的に取りました${because(p)}`,
  lease_ended: p =>
    `${LEASE_END[p.why ?? ""]?.(p) ?? "動作権が終わりました。"}${p.servos}のトルクはオフになります。`,
  hold_ended: p =>
    p.braked
      ? `${p.servo}にブレーキをかけました。${p.at_rpm ?? p.at_pct}を続けるという確認が時間内にありませんでした。`
      : `${p.servo}の保持指令${p.at_rpm ?? p.at_pct ?? ""}が終了しました。${p.problem ?? ""}`,
  move_ended: p => `${p.servo}の${p.to_deg}への動作は${p.at_deg}で終了しました。${p.problem ?? ""}`,
  stream_ended: p => `${p.servos}台へのストリームが終了しました。${p.problem ?? ""}`,
  command_ended: p => `${p.servo}への指令の継続を終了しました。もう一度指令してください。${p.problem ?? ""}`,

  stopped: p =>
    p.before_start
      ? `サーバの再起動前に${who(p.by)}が停止したままです。検出したサーボのトルクを${mode(p)}にします。`
      : p.reach === "none"
        ? `${who(p.by)}が停止を押しました。オブザーバなので何も送信していません。止めるには電源を切ってください。`
        : p.reach === "own"
          ? `${who(p.by)}が停止しました。ゲストなので、hornbillが指令するサーボ（${p.servos || "なし"}）だけのトルクを${mode(p)}にします。`
          : p.bus_lost
            ? `${who(p.by)}が停止しましたが、バスが失われています。バスが戻り次第、全サーボのトルクを${mode(p)}にします。それまで、${CUT}`
            : `${who(p.by)}が停止しました。全サーボのトルクを${mode(p)}にします。`,
  stopped_late: p => `${p.servo}が応答しました: トルクは${mode(p)}です。`,
  stop_cleared: p =>
    `${who(p.by)}が停止を解除しました。トルクはオンにするまでオフのままです。${
      p.unconfirmed
        ? `${p.unconfirmed}は未確認です。トルクがオンのままの可能性があり、応答し次第オフにします。`
        : ""
    }`,
  no_response: p =>
    p.stop
      ? `${p.servos}が停止に応答しません。トルクがオンのままの可能性があります。応答するまで送信を続けます。${CUT}`
      : `${p.servos}がトルク${mode(p)}に応答しません。応答するまで書き込みを続けます。${CUT}`,
  torque_off: p => `${p.servo}のトルクは${mode(p)}になりました。`,

  recording_written: p =>
    `${(marks[(p.mark ?? "") as keyof typeof marks]?.(p) ?? p.text ?? "").replace(/[。.]$/, "")}。${p.name}に記録しました（${p.size_mb}）。`,
  recording_failed: p => `${p.problem ?? "記録を書き込めませんでした。"}他の処理は続きます。`,
  recordings_deleted: p => `空きを作るため、${p.names}を削除しました。`,
  log_started: p => `${p.name}にログを記録しています。`,
  log_stopped: p => `ログ${p.name}が${p.frames}フレームで終了しました。${lost(p)}`,
  log_full: p =>
    `ログ${p.name}が上限の${p.limit_mb}に達して終了しました。${lost(p)}続けるには新しいログを開始してください。`,
  log_failed: p =>
    `ログ${p.name}を書き込めず、終了しました（${(notes[p.why as keyof typeof notes]?.(p) ?? "書き込みの失敗").replace(/。$/, "")}）。${lost(p)}他の処理は続きます。`,
  bench_taken: p => `別のサーバがベンチ${p.bench}を使用しています。どちらかを停止してください。`,
  store_failed: p =>
    UNSTORED[p.what ?? ""] ?? `${p.servo ?? "サーボ"}について分かったことを保存できませんでした。${DISK}`,
} satisfies Codes["happened"];

function lost(p: Facts): string {
  return p.dropped ? `ディスクが遅く、${p.dropped}フレームを失いました。` : "";
}
