/** The frame around every page, and the choice of the page inside. */
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useLayoutEffect } from "preact/hooks";
import { connectOpen } from "../bench/connect-open";
import { type KnownServo, servo } from "../bench/fleet";
import { onKey } from "../bench/keys";
import { link } from "../bench/link";
import { isTab, route, type ServoTab } from "../bench/route";
import { signedOut } from "../bench/session";
import { shownChange } from "../change/flow";
import { lazy } from "../kit/lazy";
import { Panel } from "../kit/panel";
import { ServosPage } from "../servos/page";
import { Bands } from "./bands";
import { TopBar } from "./bar";
import { Foot } from "./foot";
import { Rail, SkipLink } from "./rail";

const ApiPage = lazy(() => import("../requests/page").then(file => file.ApiPage));
const BusPage = lazy<{ hash: string }>(() => import("../bus/page").then(file => file.BusPage));
const CommissionPage = lazy(() => import("../commission/page").then(file => file.CommissionPage));
const FaultsPage = lazy<{ uid: string | null }>(() => import("../faults/page").then(file => file.FaultsPage));
const KeysHelp = lazy<{ onClose: () => void }>(() => import("./keys-help").then(file => file.KeysHelp));
const LoginPage = lazy(() => import("../login/page").then(file => file.LoginPage));
const MatrixPage = lazy<{ hash: string }>(() => import("../matrix/page").then(file => file.MatrixPage));
const OverviewPage = lazy<{ uid: string }>(() => import("../overview/page").then(file => file.OverviewPage));
const MissingPage = lazy(() => import("./missing").then(file => file.MissingPage));
const MissingServo = lazy<{ uid: string }>(() => import("./missing").then(file => file.MissingServo));
const MotionPage = lazy<{ uid: string }>(() => import("../motion/page").then(file => file.MotionPage));
const ParametersPage = lazy<{ uid: string; hash: string }>(() =>
  import("../parameters/page").then(file => file.ParametersPage),
);
const RecorderPage = lazy<{ hash: string }>(() => import("../recorder/page").then(file => file.RecorderPage));
const RecordsPage = lazy<{ hash: string }>(() => import("../records/page").then(file => file.RecordsPage));
const ScopePage = lazy(() => import("../scope/page").then(file => file.ScopePage));
const ServoPage = lazy<{ one: KnownServo; tab: ServoTab; children: ComponentChildren }>(() =>
  import("../servo/page").then(file => file.ServoPage),
);
const SitePage = lazy(() => import("../site/page").then(file => file.SitePage));
const TunePage = lazy<{ uid: string | null }>(() => import("../tune/page").then(file => file.TunePage));
const ChangeDialog = lazy(() => import("../change/dialog").then(file => file.ChangeDialog));
const ConnectDialog = lazy(() => import("../bus/connect").then(file => file.ConnectDialog));

export function App() {
  const help = useSignal(false);
  useLayoutEffect(() => {
    const open = () => {
      help.value = true;
    };
    return onKey("?", open);
  }, [help]);
  return (
    <div class="frame" data-link={link.value.state}>
      <SkipLink />
      <TopBar />
      <Panel>
        <Bands />
      </Panel>
      <Panel>
        <Rail
          onKeys={() => {
            help.value = true;
          }}
        />
      </Panel>
      <main tabIndex={-1}>
        {/* A different page starts with fresh state, even after an error on the previous one. */}
        <Panel key={route.value.uid === null ? route.value.page : "servo"}>
          {signedOut.value ? <LoginPage /> : <Page />}
        </Panel>
      </main>
      <Panel>
        <Foot />
      </Panel>
      {connectOpen.value && (
        <Panel>
          <ConnectDialog />
        </Panel>
      )}
      {shownChange.value !== null && (
        <Panel>
          <ChangeDialog />
        </Panel>
      )}
      {help.value && (
        <KeysHelp
          onClose={() => {
            help.value = false;
          }}
        />
      )}
    </div>
  );
}

function Page() {
  const { page, uid, hash } = route.value;
  if (uid !== null && servo(uid) === undefined) return <MissingServo uid={uid} />;
  const one = servo(uid);
  if (one !== undefined && isTab(page))
    return (
      <ServoPage one={one} tab={page}>
        {page === "overview" && <OverviewPage uid={one.uid} />}
        {page === "parameters" && <ParametersPage uid={one.uid} hash={hash} />}
        {page === "motion" && <MotionPage uid={one.uid} />}
        {page === "tune" && <TunePage uid={one.uid} />}
        {page === "faults" && <FaultsPage uid={one.uid} />}
      </ServoPage>
    );
  if (page === "matrix") return <MatrixPage hash={hash} />;
  if (page === "tune") return <TunePage uid={null} />;
  if (page === "faults") return <FaultsPage uid={null} />;
  if (page === "bus") return <BusPage hash={hash} />;
  if (page === "commission") return <CommissionPage />;
  if (page === "api") return <ApiPage />;
  if (page === "recorder") return <RecorderPage hash={hash} />;
  if (page === "records") return <RecordsPage hash={hash} />;
  if (page === "scope") return <ScopePage />;
  if (page === "site") return <SitePage />;
  if (page === "missing") return <MissingPage />;
  return <ServosPage />;
}
