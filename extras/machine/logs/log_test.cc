#include "extras/machine/logs/log.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/twin/testing.h"
#include "os/testing.h"

namespace upswing::machine {
namespace {

/// The only log of a text.
MachineLog Parsed(std::string_view csv) {
  const std::vector<MachineLog> pieces = ParseLog(csv, nullptr, "log.csv");
  EXPECT_EQ(pieces.size(), 1);
  return pieces.front();
}

/// The error message of a call.
template <typename Call>
std::string Complaint(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 2);
    return error.what();
  }
  ADD_FAILURE() << "expected an error";
  return "";
}

std::string ComplaintAbout(std::string_view csv) {
  return Complaint([&] { ParseLog(csv, nullptr, "log.csv"); });
}

std::string ComplaintAboutColumns(std::string_view toml) {
  return Complaint([&] { ParseLogColumns(toml, "columns.toml"); });
}

TEST(MachineLog, ReadsTheLogsOf2023) {
  const MachineLog log = Parsed(
      "time,pos_meas1,pos_meas2,vel_meas1,vel_meas2,pos_filt1,tau_con1,tau_con2,tau_meas1,"
      "tau_meas2,tau_pert1,tau_pert2\n"
      "0,1,2,3,4,99,5,6,7,8,9,10\n"
      "0.002,1.5,2.5,3.5,4.5,99,5.5,6.5,7.5,8.5,9.5,10.5\n");
  EXPECT_EQ(log.name, "log.csv");
  EXPECT_EQ(log.first_row, 1);
  EXPECT_EQ(log.time, (std::vector<double>{0, 0.002}));
  EXPECT_EQ(log.angle, (std::vector<Joints>{{1, 2}, {1.5, 2.5}}));
  EXPECT_EQ(log.velocity, (std::vector<Joints>{{3, 4}, {3.5, 4.5}}));
  EXPECT_EQ(log.commanded, (std::vector<Joints>{{5, 6}, {5.5, 6.5}}));
  EXPECT_EQ(log.measured, (std::vector<Joints>{{7, 8}, {7.5, 8.5}}));
  EXPECT_EQ(log.push, (std::vector<Joints>{{9, 10}, {9.5, 10.5}}));
}

TEST(MachineLog, ReadsTheLogsOf2022) {
  const MachineLog log =
      Parsed("time, pos1, pos2, vel1, vel2, tau1, tau2\n0,1,2,3,4,5,6\n0.005,1,2,3,4,5,6\n");
  EXPECT_EQ(log.angle.back(), (Joints{1, 2}));
  EXPECT_EQ(log.velocity.back(), (Joints{3, 4}));
  EXPECT_EQ(log.commanded.back(), (Joints{5, 6}));
  EXPECT_TRUE(log.measured.empty());
  EXPECT_TRUE(log.push.empty());
}

TEST(MachineLog, AFileNeedsOnlyTimeAndAngles) {
  const MachineLog log = Parsed("time,pos1,pos2\n0,1,2\n0,1,2\n");  // the clock may stand still
  EXPECT_EQ(log.rows(), 2);
  EXPECT_TRUE(log.velocity.empty());
  EXPECT_TRUE(log.commanded.empty());
}

/// A log with this clock (text of cycle k), columns and end of lines.
std::string LogWithClock(const std::function<std::string(int)>& clock,
                         const std::string& names = "time,pos1,pos2", const char* end = "\n") {
  std::string csv = names + end;
  for (int k = 0; k < 500; ++k) {
    for (const std::string_view name : Split(names, ',')) {
      csv += name == "time"   ? clock(k)
             : name == "pos1" ? FormatNumber(std::sin(0.01 * k))
             : name == "pos2" ? FormatNumber(std::cos(0.01 * k))
                              : "nothing";
      csv += ',';
    }
    csv.pop_back();
    csv += end;
  }
  return csv;
}

TEST(MachineLog, OriginAndUnitOfTheClockAndLayoutOfTheFileChangeNoBit) {
  const auto ms = [](double origin, double scale) {
    return [origin, scale](int k) { return fmt::format("{:.6f}", scale * (origin + 2.5 * k)); };
  };
  const MachineLog log = Parsed(LogWithClock(ms(0, 1e-3)));
  const auto expect_same = [&](const MachineLog& other) {
    EXPECT_EQ(log.time, other.time);
    EXPECT_EQ(log.angle, other.angle);
  };
  EXPECT_EQ(log.time[3], 0.0075);
  for (const double origin : {-5e3, 0.002, 3.6e6, 1.7e12, -1e11}) {
    expect_same(Parsed(LogWithClock(ms(origin, 1e-3))));
    for (const auto& [unit, scale] : {std::pair{"ms", 1.0}, {"us", 1e3}}) {
      const LogColumns columns = ParseLogColumns(
          Concat("time = {column = 'time', unit = '", unit, "'}\nangle1 = 'pos1'\nangle2 = 'pos2'"),
          "columns.toml");
      expect_same(ParseLog(LogWithClock(ms(origin, scale)), &columns, "log.csv").front());
    }
  }
  expect_same(Parsed(LogWithClock(ms(0, 1e-3), "note,pos2,time,x,x,pos1", "\r\n")));
  // A clock of odd times keeps its digits.
  EXPECT_NEAR(Parsed("time,pos1,pos2\n0,1,2\n5.075424909591675,1,2\n").time[1], 5.075424909591675,
              1e-14);
  // A piece has its own clock; messages cite that of the file.
  const LogColumns columns =
      ParseLogColumns("time='t'\nangle1='a'\nangle2='b'\npiece='n'", "columns.toml");
  EXPECT_EQ(ParseLog("n,t,a,b\n1,0,0,0\n1,1,0,0\n2,1.7e9,0,0\n2,1700000001,0,0\n", &columns, "x")
                .back()
                .time,
            (std::vector<double>{0, 1}));
}

TEST(MachineLog, AColumnIsThereOnceAndStandsForOneQuantity) {
  EXPECT_EQ(ComplaintAbout("time,pos1,pos1,pos2\n0,1,2,3\n1,1,2,3\n"),
            "log.csv:1: expected one column \"pos1\", got 2");
  const std::string good = "time = 't'\nangle1 = 'q'\nangle2 = 'r'\n";
  for (const char* key : {"velocity1", "commanded2", "measured1", "push2", "piece"}) {
    EXPECT_EQ(
        ComplaintAboutColumns(Concat(good, key, " = 'q'\n")),
        Concat("columns.toml: expected a column for each key, got \"q\" for angle1 and ", key));
  }
  EXPECT_EQ(ComplaintAboutColumns("time = 'q'\nangle1 = {column = 'q'}\nangle2 = 'r'\n"),
            "columns.toml: expected a column for each key, got \"q\" for time and angle1");
  EXPECT_EQ(ComplaintAbout("time,pos1,pos2,vel2\n0,1,2,3\n1,1,2,3\n"),
            "log.csv: expected the velocities of both joints or of neither, got one");
}

TEST(MachineLog, BadFilesGetOneLineWithThePlace) {
  const std::string head = "time,pos1,pos2\n0,1,2\n";
  EXPECT_EQ(ComplaintAbout(head + "1,nan,2\n"),
            "log.csv:3: pos1: expected a finite number, got \"nan\": a missing value; remove or "
            "fill its row");
  EXPECT_EQ(ComplaintAbout(head + "1,2,\n"),
            "log.csv:3: pos2: expected a finite number, got \"\": a missing value; remove or fill "
            "its row");
  EXPECT_EQ(ComplaintAbout(head + "1,2\n"), "log.csv:3: expected 3 columns, got 2");
  EXPECT_EQ(ComplaintAbout(head + "1,2,3\n0.5,2,3\n"),
            "log.csv: row 3: time: expected at least 1 s as in the row before, got 0.5 s: the "
            "clock was set back by 0.5 s, as NTP and users do; log a clock that is never set, such "
            "as CLOCK_MONOTONIC or Python's time.monotonic()");
  EXPECT_EQ(ComplaintAbout(head + "1,2,3\n0.01,2,3\n"),
            "log.csv: row 3: time: expected at least 1 s as in the row before, got 0.01 s: split "
            "logs that follow each other, name a column by piece, or the key wrap of a clock that "
            "starts again");
  EXPECT_EQ(ComplaintAbout("time,pos1\n0,1\n1,1\n"),
            "log.csv:1: expected a column \"pos2\", got \"time,pos1\"");
  EXPECT_EQ(
      ComplaintAbout("t,q1,q2\n0,1,2\n"),
      "log.csv: expected the columns time and pos_meas1 or pos1, or --columns FILE that names "
      "yours, got \"t,q1,q2\"");
  EXPECT_EQ(ComplaintAbout(head), "log.csv: row 1: expected at least 2 rows, got 1");
  EXPECT_EQ(ComplaintAbout("time,pos1,pos2\n"), "log.csv: row 1: expected at least 2 rows, got 0");
  EXPECT_EQ(ComplaintAbout(head + "1,2e13,0\n"),
            "log.csv: row 2: pos1: expected a number of magnitude 0 to 1e+12, got 2e+13");
  EXPECT_NE(ComplaintAbout(""), "");
}

TEST(MachineLog, OwnColumnsAndUnits) {
  const LogColumns columns = ParseLogColumns(R"(
    time = {column = "t", unit = "ms"}
    angle1 = {column = "shoulder", unit = "deg"}
    angle2 = {column = "elbow", unit = "deg", factor = -1}
    velocity1 = {column = "w1", unit = "rpm"}
    velocity2 = {column = "w2", unit = "deg/s"}
    commanded1 = {column = "u", unit = "mNm"}
    measured1 = {column = "amps", factor = 0.5}
  )",
                                             "columns.toml");
  const auto logs = ParseLog(
      "u,amps,t,shoulder,elbow,w1,w2\n1500,4,0,90,45,60,180\n"
      "-1500,-4,2,180,-90,-60,-180\n",
      &columns, "own.csv");
  ASSERT_EQ(logs.size(), 1);
  const MachineLog& log = logs.front();
  EXPECT_DOUBLE_EQ(log.time[1], 0.002);
  EXPECT_DOUBLE_EQ(log.angle[0][0], std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(log.angle[0][1], -std::numbers::pi / 4);
  EXPECT_DOUBLE_EQ(log.velocity[0][0], 2 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(log.velocity[0][1], std::numbers::pi);
  EXPECT_EQ(log.commanded[0], (Joints{1.5, 0}));  // joint 2 has no motor
  EXPECT_EQ(log.measured[1], (Joints{-2, 0}));
}

/// A column's name in a logger's header, and its scale; 0: refused.
struct Header {
  const char* name;
  double scale;
};

/// The scale that a column has without a unit or a factor; 0 if it is refused.
double ScaleIn(const std::string& key, const std::string& name) {
  std::string toml;
  for (const char* other : {"time", "angle1", "angle2", "velocity1", "commanded1"}) {
    toml += Concat(other, " = \"", other == key ? name : Concat("other ", toml.size()), "\"\n");
  }
  try {
    const LogColumns columns = ParseLogColumns(toml, "columns.toml");
    if (key == "time") return columns.time.scale;
    if (key == "angle1") return columns.angle[0].scale;
    return key == "velocity1" ? columns.velocity[0].scale : columns.commanded[0].scale;
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("expected one of the units "), std::string::npos) << text;
    EXPECT_NE(text.find("got the unit "), std::string::npos) << text;
    return 0;
  }
}

void ExpectScales(const std::string& key, const std::vector<Header>& headers) {
  for (const auto& [name, scale] : headers)
    EXPECT_EQ(ScaleIn(key, name), scale) << key << ": " << name;
}

TEST(MachineLog, UnitsInTheNamesOfLoggersAreReadOrRefused) {
  constexpr double kDegree = std::numbers::pi / 180;
  ExpectScales("time", {{"t", 1},          {"time", 1},           {"Time (s)", 1},
                        {"timestamp", 1},  {"__time", 1},         {"header.stamp.secs", 1},
                        {"time_sec", 1},   {"elapsedSeconds", 1}, {"Time, s", 1},
                        {"time_ms", 1e-3}, {"t [us]", 1e-6},      {"%time", 1},
                        {"timeMs", 0},     {"millis", 0},         {"micros()", 0},
                        {"t/ms", 0},       {"time_usec", 0},      {"ms_since_boot", 0},
                        {"us", 0},         {"stamp.nsecs", 0},    {"t_µs", 0},
                        {"t_min", 0},      {"sample", 0},         {"tick", 0}});
  ExpectScales("angle1", {{"q1", 1},
                          {"theta_1", 1},
                          {"pos_meas1", 1},
                          {"/joint_states/position[0]", 1},
                          {"axis0.encoder.pos_estimate", 1},
                          {"theta_s", 1},
                          {"q_A", 1},
                          {"encoder", 1},
                          {"angle_rad", 1},
                          {"theta1Radians", 1},
                          {"q1_deg", kDegree},
                          {"Angle 1 (deg)", kDegree},
                          {"q1_degs", 0},
                          {"angle_degrees", 0},
                          {"angleDeg", 0},
                          {"theta1deg", 0},
                          {"q1/deg", 0},
                          {"q1 °", 0},
                          {"Angle (deg) 1", 0},
                          {"q_deg_1", 0},
                          {"Angle_deg_", 0},
                          {"pos_qc", 0},
                          {"pos_cdeg", 0},
                          {"angledeg", 0},
                          {"phi_deg_filtered", 0},
                          {"enc1_counts", 0},
                          {"encCounts", 0},
                          {"ticks1", 0},
                          {"pos_mrad", 0},
                          {"pos_rev", 0},
                          {"pot_V", 0}});
  ExpectScales("velocity1", {{"w1", 1},
                             {"dq1", 1},
                             {"theta1_dot", 1},
                             {"joint_vel[0]", 1},
                             {"vel_estimate", 1},
                             {"w1_rad/s", 1},
                             {"w1_rad_s", 1},
                             {"omega_rad_per_s", 1},
                             {"w_rads", 1},
                             {"w1_deg/s", kDegree},
                             {"speed [rpm]", 2 * std::numbers::pi / 60},
                             {"w1_degs", 0},
                             {"w1_dps", 0},
                             {"speedRPM", 0},
                             {"RPM1", 0},
                             {"w1_deg_per_s", 0},
                             {"gyro_°/s", 0},
                             {"w/(deg/s)", kDegree},
                             {"w_rev/s", 0},
                             {"tach_V", 0}});
  ExpectScales(
      "commanded1",
      {{"u", 1},          {"tau_con1", 1},  {"effort[0]", 1},   {"controller.input_torque", 1},
       {"iq", 1},         {"torque_Nm", 1}, {"u_N.m", 1},       {"torque (N·m)", 1},
       {"u_mNm", 1e-3},   {"u/mNm", 0},     {"i_A", 0},         {"current_mA", 0},
       {"motor_amps", 0}, {"u_oz-in", 0},   {"torque_ozin", 0}, {"u lb.ft", 0},
       {"u_kg-cm", 0},    {"u_N-mm", 0},    {"Vm_V", 0},        {"Current_A_", 0},
       {"pwm", 0},        {"duty_%", 0},    {"cmd_percent", 0}});
}

TEST(MachineLog, AUnitOrAFactorSettlesTheScale) {
  const auto scale = [](const char* column) {
    const std::string toml = Concat("time = \"t\"\nangle1 = \"a\"\nangle2 = \"b\"\n", column);
    const LogColumns columns = ParseLogColumns(toml, "columns.toml");
    return columns.commanded[0].scale;
  };
  EXPECT_EQ(scale(R"(commanded1 = {column = "u/mNm", unit = "mNm"})"), 1e-3);
  EXPECT_EQ(scale(R"(commanded1 = {column = "i_A", factor = 0.05})"), 0.05);
  EXPECT_EQ(scale(R"(commanded1 = {column = "u_oz-in", factor = -0.00706})"), -0.00706);
  EXPECT_EQ(
      ComplaintAboutColumns("time = \"t\"\nangle1 = \"a\"\nangle2 = \"b\"\n"
                            "commanded1 = {column = \"u_oz-in\", factor = -1}\n"),
      "columns.toml:4: commanded1: expected one of the units Nm, N·m, mNm, mN·m, or a factor, "
      "got the unit \"oz-in\"");
  EXPECT_EQ(ComplaintAboutColumns("time = \"t\"\nangle1 = \"Q1_DEG_\"\nangle2 = \"b\"\n"),
            "columns.toml:2: angle1: expected one of the units rad, deg, turn, or a factor, as in "
            "{column = \"Q1_DEG_\", unit = \"deg\"}, got the unit \"DEG\"");
}

TEST(MachineLog, AClockOf32BitsGoesOnWhereItBeginsAgain) {
  const LogColumns columns = ParseLogColumns(
      "time = {column = \"t\", unit = \"us\", wrap = 4294967296}\nangle1 = \"a\"\n"
      "angle2 = \"b\"\n",
      "columns.toml");
  const auto log = [&](const char* csv) { return ParseLog(csv, &columns, "log.csv").front(); };
  const MachineLog wrapped =
      log("t,a,b\n4294965296,0,0\n4294967294,0,0\n1998,0,0\n4000,0,0\n4294967000,0,0\n5,0,0\n");
  const std::vector<double> expected{0, 0.001998, 0.003998, 0.006, 4294.969000, 4294.969301};
  ASSERT_EQ(wrapped.rows(), 6);
  for (size_t k = 0; k < 6; ++k) EXPECT_NEAR(wrapped.time[k], expected[k], 1e-9) << k;
  // A clock that goes back a little is an error as before.
  EXPECT_NE(Complaint([&] { log("t,a,b\n2000,0,0\n1000,0,0\n"); }).find("time: expected"),
            std::string::npos);
}

TEST(MachineLog, ReadsRolloutsOfThisAndOfOlderVersions) {
  const MachineLog now = Parsed(
      "t,q1,q2,w1,w2,torque,energy,torque1,torque2\n0,1,2,3,4,9,0,0,9\n"
      "0.02,1.5,2.5,3.5,4.5,8,0,0,8\n0.04,1.6,2.6,3.6,4.6,7,0,0,7\n");
  EXPECT_EQ(now.angle.front(), (Joints{1, 2}));
  EXPECT_EQ(now.velocity.back(), (Joints{3.6, 4.6}));
  // A log's command is sent at the reading of the next row; a rollout's torque begins at its own.
  EXPECT_EQ(now.commanded[0], (Joints{0, 8}));
  EXPECT_EQ(now.commanded[1], (Joints{0, 7}));
  EXPECT_EQ(UnitsText(now.columns), "t [s]; q1, q2 [rad]; w1, w2 [rad/s]; torque1, torque2 [N·m]");
  const MachineLog old =
      Parsed("t,qpos0,qpos1,qvel0,qvel1,torque\n0,1,2,3,4,9\n0.02,1.5,2.5,3.5,4.5,8\n");
  EXPECT_EQ(old.angle.back(), (Joints{1.5, 2.5}));
  EXPECT_EQ(old.commanded[0], (Joints{8, 0}));
}

TEST(MachineLog, AbsoluteAnglesThatHangAtPi) {
  const LogColumns columns = ParseLogColumns(R"(
    time = "t"
    angle1 = {column = "a", hanging = 3.0}
    angle2 = {column = "b", hanging = 3.0}
    velocity1 = "va"
    velocity2 = "vb"
    absolute = true
  )",
                                             "columns.toml");
  const MachineLog log =
      ParseLog("t,a,b,va,vb\n0,3,3,1,1\n1,3.5,4.5,2,5\n", &columns, "own.csv").front();
  EXPECT_EQ(log.angle[0], (Joints{0, 0}));
  EXPECT_EQ(log.angle[1], (Joints{0.5, 1}));  // joint 2 relative to link 1
  EXPECT_EQ(log.velocity[1], (Joints{2, 3}));
}

TEST(MachineLog, AMotionHasOneLogInAnyConventionOfItsAngles) {
  // One motion over two turns of joint 1 and back, as loggers write it.
  std::string turns = "t,a,b\n", degrees = "t;a;b\n", counts = "t,a,b\n", lean = "t,a,b\n";
  const auto wrapped = [](double x, double turn) { return x - turn * std::floor(x / turn); };
  for (int k = 0; k < 100; ++k) {
    const double a = 2.5 * std::sin(0.1 * k), b = -0.3 * a;  // turns, joint 2 relative
    turns += Concat(0.01 * k, ",", a, ",", b, "\n");
    degrees +=
        Concat(10 * k, ";", 360 * (wrapped(a + 0.25, 1) - 0.5), ";", 360 * wrapped(a + b, 1), "\n");
    counts += Concat(0.01 * k, ",", wrapped(4096 * a + 100, 4096), ",", -4096 * b, "\n");
    lean += Concat(0.01 * k, ",", a - 0.25, ",", a + b - 0.25, "\n");
  }
  const auto read = [](std::string csv, const std::string& a, const std::string& b,
                       const std::string& more) {
    std::ranges::replace(csv, '.', csv.find(';') != csv.npos ? ',' : '.');
    const LogColumns columns = ParseLogColumns(
        Concat("angle1 = {column = \"a\", ", a, "}\nangle2 = {column = \"b\", ", b, "}\n", more),
        "columns.toml");
    return ParseLog(csv, &columns, "own.csv").front().angle;
  };
  const std::string unit = "unit = \"turn\"", seconds = "time = \"t\"\n";
  const auto expected = read(turns, unit, unit, seconds);
  const auto same = [&](const std::vector<Joints>& angle) {
    ASSERT_EQ(angle.size(), expected.size());
    for (size_t k = 0; k < angle.size(); ++k) {
      for (const int joint : {0, 1}) EXPECT_NEAR(angle[k][joint], expected[k][joint], 1e-4);
    }
  };
  same(read(degrees, "unit = \"deg\", wrap = 360, hanging = -90", "unit = \"deg\", wrap = 360",
            "time = {column = \"t\", unit = \"ms\"}\nabsolute = true\n"));
  same(read(counts, unit + ", wrap = 4096, factor = 0.000244140625, hanging = 100",
            unit + ", factor = -0.000244140625", seconds));
  same(read(lean, unit + ", hanging = -0.25", unit + ", hanging = -0.25",
            seconds + "absolute = true\n"));
}

TEST(MachineLog, EachPieceOfWrappedAnglesBeginsNearestToHanging) {
  const LogColumns columns = ParseLogColumns(R"(
    time = "t"
    angle1 = {column = "a", unit = "deg", wrap = 360}
    angle2 = {column = "b", unit = "deg", wrap = 360}
    piece = "n"
    absolute = true
  )",
                                             "columns.toml");
  const auto pieces =
      ParseLog("n,t,a,b\n1,0,350,10\n1,1,200,220\n1,2,0,20\n2,0,181,179\n2,1,179,181\n", &columns,
               "own.csv");
  ASSERT_EQ(pieces.size(), 2);
  constexpr double kDegree = std::numbers::pi / 180;
  const double expected[][2] = {{-10, 20}, {-160, 20}, {0, 20}, {-179, -2}, {-181, 2}};
  for (int k = 0; k < 5; ++k) {
    const Joints& q = k < 3 ? pieces[0].angle[k] : pieces[1].angle[k - 3];
    for (const int j : {0, 1}) EXPECT_NEAR(q[j], expected[k][j] * kDegree, 1e-12) << k;
  }
}

TEST(MachineLog, APieceBeginsWhereItsColumnChanges) {
  const LogColumns columns = ParseLogColumns(
      "time = \"t\"\nangle1 = \"a\"\nangle2 = \"b\"\npiece = \"n\"\n", "columns.toml");
  const std::string csv = "n,t,a,b\n4,0,1,1\n4,1,2,2\n7,0,3,3\n7,1,4,4\n7,2,5,5\n";
  const auto logs = ParseLog(csv, &columns, "own.csv");
  ASSERT_EQ(logs.size(), 2);
  EXPECT_EQ(logs[0].name, "own.csv n 4");
  EXPECT_EQ(logs[1].name, "own.csv n 7");
  EXPECT_EQ(logs[0].rows(), 2);
  EXPECT_EQ(logs[1].first_row, 3);
  EXPECT_EQ(logs[1].angle, (std::vector<Joints>{{3, 3}, {4, 4}, {5, 5}}));
  EXPECT_EQ(Complaint([&] { ParseLog(csv + "8,0,1,1\n", &columns, "own.csv"); }),
            "own.csv: row 6: expected at least 2 rows, got 1");
}

TEST(MachineLog, AColumnOfPiecesThatIsAnotherColumn) {
  const LogColumns columns = ParseLogColumns(
      "time = \"t\"\nangle1 = \"a\"\nangle2 = \"b\"\npiece = \"c\"\n", "columns.toml");
  std::string csv = "t,a,b,c\n";
  for (int k = 0; k < 10001; ++k) csv += Concat("0,0,0,", k, "\n1,0,0,", k, "\n");
  EXPECT_EQ(Complaint([&] { ParseLog(csv, &columns, "own.csv"); }),
            "own.csv: row 20001: c: expected at most 10000 pieces, got more");
}

TEST(MachineLog, BadColumnFilesGetOneLineWithThePlace) {
  const std::string good = "time = \"t\"\nangle1 = \"a\"\nangle2 = \"b\"\n";
  EXPECT_EQ(ComplaintAboutColumns("time = \"t\"\nangle1 = \"a\"\n"),
            "columns.toml: expected the key angle2, got none");
  EXPECT_EQ(ComplaintAboutColumns(good + "speed1 = \"w\"\n").substr(0, 37),
            "columns.toml:4: speed1: expected one ");
  EXPECT_EQ(ComplaintAboutColumns(good + "velocity1 = {column = \"w\", unit = \"deg\"}\n"),
            "columns.toml:4: velocity1: unit: expected rad/s, deg/s, turn/s, rpm, got \"deg\"");
  for (const std::string name : {"w [degrees/s]", "w (1/min)", "w (raw)"}) {
    EXPECT_EQ(
        ComplaintAboutColumns(Concat(good, "velocity1 = {column = \"", name, "\", factor = -1}\n")),
        Concat("columns.toml:4: velocity1: expected one of the units rad/s, deg/s, turn/s, rpm, or "
               "a factor, got the unit \"",
               name.substr(3, name.size() - 4), "\""));
  }
  EXPECT_EQ(
      ComplaintAboutColumns(good + "commanded1 = \"u [mN m]\"\n"),
      "columns.toml:4: commanded1: expected one of the units Nm, N·m, mNm, mN·m, or a factor, "
      "as in {column = \"u [mN m]\", unit = \"mNm\"}, got the unit \"mN m\"");
  EXPECT_EQ(ParseLogColumns(good + "commanded1 = \"u[1]\"\n", "").commanded[0].scale, 1);
  EXPECT_EQ(ComplaintAboutColumns(good + "velocity1 = {unit = \"rpm\"}\n"),
            "columns.toml:4: velocity1: expected a column, got none");
  EXPECT_EQ(ComplaintAboutColumns(good + "velocity1 = {column = \"w\", sign = -1}\n"),
            "columns.toml:4: velocity1: expected column, unit or factor, got sign");
  EXPECT_EQ(
      ComplaintAboutColumns(good + "velocity1 = {column = \"w\", factor = 0}\n"),
      "columns.toml:4: velocity1: factor: expected a number of magnitude 1e-09 to 1e+09, got 0");
  EXPECT_EQ(ComplaintAboutColumns(good + "velocity1 = 3\n"),
            "columns.toml:4: velocity1: expected the name of a column in quotes, got 3");
  EXPECT_EQ(ComplaintAboutColumns(good + "absolute = 1\n"),
            "columns.toml:4: absolute: expected true or false, got 1");
  EXPECT_EQ(ComplaintAboutColumns(good + "absolute = \"true\"\n"),
            "columns.toml:4: absolute: expected true or false, got \"true\"");
  EXPECT_EQ(ComplaintAboutColumns(good + "velocity1 = {column = \"w\", factor = \"-1\"}\n"),
            "columns.toml:4: velocity1: factor: expected a number of magnitude 1e-09 to 1e+09, got "
            "\"-1\"");
  EXPECT_EQ(ComplaintAboutColumns(good + "velocity1 = \"\"\n"),
            "columns.toml:4: velocity1: expected the name of a column in quotes, got \"\"");
  EXPECT_EQ(ComplaintAboutColumns(good + "hanging = 3\n"),
            "columns.toml:4: hanging: expected it with an angle, such as angle1 = {column = \"a\", "
            "hanging = 180}");
  EXPECT_EQ(ComplaintAboutColumns("angle1 = {column = \"a\", hanging = inf}\n").substr(0, 50),
            "columns.toml:1: angle1: hanging: expected a number");
  EXPECT_EQ(ComplaintAboutColumns("angle1 = {column = \"a\", wrap = 0}\n").substr(0, 47),
            "columns.toml:1: angle1: wrap: expected a number");
  EXPECT_EQ(ComplaintAboutColumns("angle1 = {column = \"a\", sign = -1}\n"),
            "columns.toml:1: angle1: expected column, unit, factor, wrap or hanging, got sign");
  EXPECT_NE(ComplaintAboutColumns(good + "absolute = [\n"), "");
}

TEST(MachineLog, ReadsFilesAndNamesThem) {
  const TempFolder folder;
  std::ofstream(folder / "log.csv") << "t,a,b\n0,1,2\n1,3,4\n";
  std::ofstream(folder / "columns.toml") << "time = \"t\"\nangle1 = \"a\"\nangle2 = \"b\"\n";
  const auto logs = ReadLog(folder / "log.csv", folder / "columns.toml");
  EXPECT_EQ(logs.front().angle[1], (Joints{3, 4}));
  EXPECT_NE(Complaint([&] { ReadLog(folder / "none.csv"); }).find("none.csv"), std::string::npos);
  std::ofstream(folder / "cut.csv.gz") << "\x1f\x8b\x08";
  EXPECT_NE(Complaint([&] { ReadLog(folder / "cut.csv.gz"); }).find("only its beginning"),
            std::string::npos);
}

TEST(MachineLog, ReadsTheMeasuredData) {
  const auto real = RealData();
  if (real.empty()) GTEST_SKIP() << "no measured data in UPSWING_REAL or ../shared/real";
  const MachineLog pushed = ReadLog(real / "C.1/pushed/pendubot-tvlqr-01.csv.gz").front();
  EXPECT_EQ(pushed.rows(), 2497);
  EXPECT_EQ(pushed.push.size(), 2497);
  EXPECT_EQ(pushed.measured.size(), 2497);
  EXPECT_NEAR(pushed.time.back(), 5.075424909591675, 1e-12);
  const MachineLog old = ReadLog(real / "A.0/free_decay/20220812-060143.csv.gz").front();
  EXPECT_EQ(old.rows(), 1998);
  EXPECT_TRUE(old.measured.empty());
  EXPECT_EQ(old.commanded.back(), (Joints{0, 0}));

  const TempFolder folder;
  std::ofstream(folder / "columns.toml")
      << "time = \"time\"\nangle1 = {column = \"theta1\", hanging = 3.14159265}\n"
         "angle2 = {column = \"theta2\", hanging = 3.14159265}\nvelocity1 = \"omega1\"\n"
         "velocity2 = \"omega2\"\npiece = \"segment\"\nabsolute = true\n";
  const auto pieces = ReadLog(real / "multiarm/free_swing.csv.gz", folder / "columns.toml");
  EXPECT_EQ(pieces.size(), 20);
  int rows = 0;
  for (const MachineLog& piece : pieces) {
    EXPECT_EQ(piece.first_row, rows + 1);
    rows += piece.rows();
  }
  EXPECT_EQ(rows, 53340);
  EXPECT_NEAR(pieces[0].angle[0][0], 2.615775 - std::numbers::pi, 1e-6);
  EXPECT_NEAR(pieces[0].angle[0][1], 3.541416 - 2.615775, 1e-12);
}

}  // namespace
}  // namespace upswing::machine
