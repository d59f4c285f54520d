#include "extras/realaigym/hardware.h"

#include <gtest/gtest.h>

#include <array>
#include <numbers>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/twin/testing.h"

namespace upswing::realaigym {
namespace {

/// A run of 10 s at 100 Hz: hangs, stands upright from `up` to `down` (s), hangs again.
MachineLog UpBetween(double up, double down) {
  MachineLog log;
  log.name = "run";
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.01 * k;
    log.time.push_back(t);
    log.angle.push_back({t >= up && t < down ? std::numbers::pi : 0, 0});
    log.velocity.push_back({0, 2});
    log.commanded.push_back({k % 2 == 0 ? 1.0 : -1.0, 0.5});
  }
  return log;
}

TEST(Hardware, MeasuresOfARun) {
  const BoardOutcome o = OutcomeOf(UpBetween(3, 20));
  EXPECT_TRUE(o.above_line);
  EXPECT_NEAR(o.swing_up_seconds, 3, 1e-12);
  EXPECT_NEAR(o.energy, std::numbers::pi, 1e-12);  // one jump by π against 1 N·m
  EXPECT_NEAR(o.torque_cost, 1.25 * 9.99, 1e-9);   // (1 + 0.25) N²m² for 9.99 s
  EXPECT_NEAR(o.velocity_cost, 4 * 9.99, 1e-9);
  EXPECT_NEAR(o.smoothness, 2, 1e-5);  // changes of ±2 N·m
  EXPECT_EQ(o.max_torque, 1);
}

TEST(Hardware, FailuresScoreZero) {
  EXPECT_FALSE(OutcomeOf(UpBetween(3, 9)).above_line);
  EXPECT_EQ(OutcomeOf(UpBetween(3, 9)).swing_up_seconds, 9.99);
  EXPECT_FALSE(OutcomeOf(UpBetween(20, 20)).above_line);
  // The benchmark does not look at the last row.
  EXPECT_TRUE(OutcomeOf(UpBetween(3, 9.985)).above_line);
  // A run that stops early fails although it is up.
  MachineLog early = UpBetween(3, 20);
  for (std::vector<Joints>* rows : {&early.angle, &early.velocity, &early.commanded}) {
    rows->resize(980);
  }
  early.time.resize(980);
  EXPECT_FALSE(OutcomeOf(early).above_line);
  EXPECT_EQ(ScoreHardware(std::span(&early, 1), {}).mean(), 0);
}

TEST(Hardware, NormalisersOfTheBoards) {
  EXPECT_EQ(HardwareScales(Robot::kPendubot, false).torque_cost, 100);
  EXPECT_EQ(HardwareScales(Robot::kPendubot, true).smoothness, 4);
  EXPECT_EQ(HardwareScales(Robot::kAcrobot, false).smoothness, 4);
  EXPECT_EQ(HardwareScales(Robot::kAcrobot, true).torque_cost, 20);
  EXPECT_EQ(HardwareScales(Robot::kAcrobot, true).smoothness, 1);
}

TEST(Hardware, PublishedEntriesFollowTheFormula) {
  // Time, energy, torque cost, smoothness, velocity cost and score of the best run of an entry.
  struct Entry {
    Robot robot;
    bool pushed;
    double time, energy, cost, smooth, velocity, best;
  };
  for (const Entry& e : {Entry{Robot::kAcrobot, true, 4.05, 14.66, 3.82, .079, 110.92, .462},
                         Entry{Robot::kAcrobot, false, 4.03, 13.72, 3.43, .075, 109.7, .592},
                         Entry{Robot::kAcrobot, false, 1.55, 17.95, 11.73, .671, 118.38, .492},
                         Entry{Robot::kPendubot, true, .77, 11.7, 7.33, .237, 49.53, .711},
                         Entry{Robot::kPendubot, true, 4.12, 29.24, 20.0, .375, 249.44, .343},
                         Entry{Robot::kPendubot, false, 1.37, 11.66, 8.93, .54, 84.61, .598},
                         Entry{Robot::kPendubot, false, 4.12, 34.02, 51.88, .643, 242.34, .227}}) {
    const BoardOutcome o{e.time, e.energy, 0, e.cost, e.smooth, e.velocity, true};
    // The board rounds its columns.
    EXPECT_NEAR(PerformanceScore(o, HardwareScales(e.robot, e.pushed)), e.best, 0.0011);
  }
}

TEST(Hardware, TheMotorIsWhereTheTorqueIs) {
  MachineLog log = UpBetween(3, 20);
  EXPECT_EQ(RobotIn(log), Robot::kPendubot);
  for (Joints& u : log.commanded) std::swap(u[0], u[1]);
  EXPECT_EQ(RobotIn(log), Robot::kAcrobot);
}

TEST(Hardware, RefusesOtherLogs) {
  const MachineLog good = UpBetween(3, 20);
  MachineLog bad = good;
  bad.velocity.clear();
  EXPECT_THROW(OutcomeOf(bad), Error);
  bad = good;
  bad.commanded.clear();
  EXPECT_THROW(OutcomeOf(bad), Error);
  bad.commanded.assign(good.commanded.size(), {});
  EXPECT_THROW(OutcomeOf(bad), Error);
  bad = good;
  bad.push.resize(1000);
  EXPECT_THROW(ScoreHardware(std::array{good, bad}, {}), Error);  // only one has pushes
  MachineLog acrobot = good;
  for (Joints& u : acrobot.commanded) std::swap(u[0], u[1]);
  EXPECT_THROW(ScoreHardware(std::array{good, acrobot}, {}), Error);
  EXPECT_EQ(ScoreHardware(std::array{good, acrobot}, Robot::kAcrobot).successes(), 2);
}

/// Published measures of a run; score 0 for a failure.
struct PublishedRun {
  const char* file;
  double seconds, energy, torque_cost, smoothness, velocity_cost, score;
};

/// From scores_v2.csv of each run in
/// github.com/dfki-ric-underactuated-lab/real_ai_gym_leaderboard.
constexpr PublishedRun kPublishedRuns[] = {
    {"swingup/acrobot-tvlqr-01", 4.029878854751586, 13.715187302964802, 3.766054295517792,
     0.08859365664815709, 109.69569548017678, 0.5879683591379518},
    {"swingup/acrobot-tvlqr-02", 4.029735803604126, 13.76564662507919, 3.6388964672650133,
     0.08812743998823788, 109.49508022537941, 0.5886672241418547},
    {"swingup/acrobot-tvlqr-03", 4.032682418823241, 13.745024357170102, 3.264365553778265,
     0.10809818227522183, 109.76960911737756, 0.5877229722861583},
    {"swingup/acrobot-tvlqr-04", 4.031519174575806, 13.722578579584795, 3.329555685429952,
     0.10895239767187012, 109.96517146664979, 0.5871977177847926},
    {"swingup/acrobot-tvlqr-05", 4.028726100921631, 13.693211349330106, 3.428470667117877,
     0.11906287782561972, 109.79918794031073, 0.5853926995796652},
    {"swingup/acrobot-mcpilco-01", 1.5255897045135498, 18.55457783434686, 12.714985990052758,
     0.6729487057627639, 121.58189418959351, 0.4819483865983839},
    {"swingup/acrobot-mcpilco-02", 1.5527353286743164, 18.164914264655884, 12.45516868517768,
     0.6675360716283137, 119.11222737184687, 0.48678283313516213},
    {"swingup/acrobot-mcpilco-03", 1.4912843704223633, 18.529184017341784, 12.229236233915856,
     0.6655308725302995, 123.04436221414868, 0.4855828168136599},
    {"swingup/acrobot-mcpilco-04", 1.5479562282562256, 18.227890906826165, 12.986488172435825,
     0.668228964978014, 118.92938677944828, 0.483819198509171},
    {"swingup/acrobot-mcpilco-05", 1.4920010566711424, 18.611333337105588, 12.190106864764685,
     0.6832740316322872, 122.99737961100675, 0.48329922195591857},
    {"swingup/pendubot-tvlqr-01", 7.592276096343993, 30.041898786911702, 20.0628070099998,
     0.4111619453188515, 313.9426705667083, 0.0},
    {"swingup/pendubot-tvlqr-02", 4.412771463394165, 39.09381451115345, 53.420739649731345,
     0.6423514810036381, 255.42234722975468, 0.21401097079397924},
    {"swingup/pendubot-tvlqr-03", 4.400810956954956, 38.97279095048071, 51.705537042611354,
     0.6107483295551839, 256.6270444129157, 0.2196113238267845},
    {"swingup/pendubot-tvlqr-04", 9.999107122421265, 33.77630234365946, 20.776046322257585,
     0.41823808252273426, 439.3238833363313, 0.0},
    {"swingup/pendubot-tvlqr-05", 4.367953062057495, 35.2716471081072, 53.44573279244919,
     0.649067751139582, 243.74702378537282, 0.21862242044343916},
    {"swingup/pendubot-mcpilco-01", 1.3721065521240234, 11.691982558060378, 9.247057619780913,
     0.536432089618087, 84.22068426778098, 0.5964209018036564},
    {"swingup/pendubot-mcpilco-02", 1.3721449375152588, 11.656568827258399, 8.934273187378643,
     0.5398028662100958, 84.60940728507781, 0.5976436797868687},
    {"swingup/pendubot-mcpilco-03", 1.3992974758148191, 11.84262978836031, 10.336574342325124,
     0.5302110745745225, 83.93313890430656, 0.5893910977031668},
    {"swingup/pendubot-mcpilco-04", 1.403743267059326, 11.813429077399809, 9.310972378019702,
     0.5334033982993993, 84.32980455659778, 0.5945004072747676},
    {"swingup/pendubot-mcpilco-05", 1.398350715637207, 12.057463101633976, 10.635689048250246,
     0.543627709706396, 84.33121642564925, 0.5839847900779653},
    {"swingup/pendubot-saclqr-01", 1.256127119064331, 19.743063343286533, 15.111872951091453,
     2.130652067361425, 117.17110140648666, 0.0},
    {"swingup/pendubot-saclqr-03", 0.6918332576751709, 41.73368793171898, 86.23864545352124,
     0.9414122500436884, 124.74094488873791, 0.308768955027495},
    {"swingup/pendubot-saclqr-05", 2.4588129520416255, 52.89037240610973, 87.65005807796823,
     0.6925666787573005, 168.66306698425487, 0.25678046344663374},
    {"pushed/acrobot-tvlqr-01", 4.069546461105347, 15.322999104851744, 4.333759426344275,
     0.11831670183940668, 110.53587759427359, 0.42447488618377405},
    {"pushed/acrobot-tvlqr-02", 9.998346328735352, 34.75363843104006, 8.679680276052764,
     0.19473794654844578, 519.0764379190962, 0.0},
    {"pushed/acrobot-tvlqr-04", 9.998238801956177, 29.202268744178, 12.721399488602959,
     0.2990090622778573, 221.5200475510372, 0.0},
    {"pushed/acrobot-tvlqr-05", 4.04364800453186, 14.32741006439259, 4.016028287966559,
     0.12359236456804035, 101.77330370054368, 0.4421953054560176},
    {"pushed/pendubot-tvlqr-02", 7.555626869201661, 46.76553412996735, 25.76681794547903,
     0.43091696658396295, 360.1171404692498, 0.0},
    {"pushed/pendubot-tvlqr-04", 6.59392523765564, 49.67345940596465, 25.60400182828434,
     0.478458225173564, 380.7228432844668, 0.0},
};

TEST(Hardware, PublishedScoresOfMeasuredRuns) {
  const auto real = RealData();
  if (real.empty()) GTEST_SKIP() << "no measured data in UPSWING_REAL or ../shared/real";
  for (const PublishedRun& run : kPublishedRuns) {
    SCOPED_TRACE(run.file);
    const auto logs = ReadLog(real / Concat("C.1/", run.file, ".csv.gz"));
    const HardwareReport report = ScoreHardware(logs, {});
    const bool acrobot = std::string_view(run.file).find("acrobot") != std::string_view::npos;
    EXPECT_EQ(report.robot, acrobot ? Robot::kAcrobot : Robot::kPendubot);
    const BoardOutcome& o = report.runs.front().outcome;
    EXPECT_NEAR(o.swing_up_seconds, run.seconds, 1e-9);
    EXPECT_NEAR(o.energy, run.energy, 1e-9);
    EXPECT_NEAR(o.torque_cost, run.torque_cost, 1e-9);
    EXPECT_NEAR(o.smoothness, run.smoothness, 1e-9);
    EXPECT_NEAR(o.velocity_cost, run.velocity_cost, 1e-9);
    EXPECT_NEAR(report.mean(), run.score, 1e-9);
    EXPECT_EQ(o.above_line, run.score > 0);
  }
}

}  // namespace
}  // namespace upswing::realaigym
