#include "extras/deploy/c_header.h"

#include <algorithm>
#include <array>
#include <bit>

#include "base/text.h"
#include "extras/deploy/c_text.h"
#include "pendulum/equations.h"

namespace upswing::deploy {
namespace {

/// The text of a file with its includes inserted.
std::string Expanded(std::string_view name) {
  constexpr std::string_view kInclude = "#include \"";
  std::string text;
  const auto file = std::ranges::find(EmbeddedCFiles(), name, &CFile::name);
  for (std::string_view line : Split(file->text, '\n')) {
    if (!line.starts_with(kInclude)) {
      text += Concat(line, '\n');
      continue;
    }
    line.remove_prefix(kInclude.size());
    line.remove_suffix(1);
    text += Expanded(line);
  }
  return text.substr(0, text.find_last_not_of('\n') + 1) + '\n';
}

std::string ArrayText(const CArray& array, const std::string& prefix) {
  std::string numbers;
  for (const float value : array.values) numbers += CLiteral(value) + ", ";
  numbers.replace(numbers.size() - 2, 2, "};");
  const std::string comment = array.comment.empty() ? "" : Concat(" /* ", array.comment, " */");
  return Concat("static const float ", prefix, '_', array.name, '[', array.values.size(), "] = {",
                comment, "\n  ", WrapText(numbers, kWidth, 2), "\n");
}

/// The C text of the constant arrays, in order, with the list that the checksum uses.
std::string TablesText(const std::vector<CArray>& arrays, const std::string& prefix) {
  std::string text = "static const struct {\n  const float *values;\n  long count;\n} ";
  text += Concat(prefix, "_tables[", arrays.size(), "] = {\n");
  for (const CArray& array : arrays) {
    text += Concat("  {", prefix, '_', array.name, ", ", array.values.size(), "L},\n");
  }
  return text + "};\n";
}

/// The checksum (FNV-1a) of these arrays, as checksum_of_all in extras/deploy/c/numbers.c computes
/// it.
uint32_t ChecksumOf(const std::vector<CArray>& arrays) {
  uint32_t sum = 2166136261U;
  for (const CArray& array : arrays) {
    for (const float value : array.values) {
      sum = (sum ^ std::bit_cast<uint32_t>(value)) * 16777619U;
    }
  }
  return sum;
}

std::string PlantParagraph(const CParts& parts) {
  if (parts.plant_use.empty()) return "";
  std::vector<std::string> values;
  for (const auto& [name, value] : PlantValues(parts.plant)) {
    values.push_back(Concat(name, ' ', FormatNumber(value)));
  }
  return Paragraph(Concat("Made for this plant (kg, m, N m s/rad, m/s2, N m), ", parts.plant_use,
                          ": ", Join(values, ", "), '.')) +
         "\n *\n";
}

/// Input and output of a foreign task's policy.
std::string ForeignInputs(const CParts& parts, const std::string& caps) {
  return Concat(" * In: the observation (", caps,
                "_OBSERVATION_SIZE), as the environment gives it.\n",
                " * Out: the action, within +-", FormatNumber(parts.limit), ".\n *\n");
}

/// Input and output of a pendulum's policy. `states` are the lines of its state.
std::string PendulumInputs(const CParts& parts, const std::string& states) {
  return Concat(" * In, in this order; an angle may have made any number of turns:\n", states,
                " * Out: the torque ", parts.task.motor, ", N m, within +-",
                FormatNumber(parts.limit), ", to be held for ", FormatNumber(parts.period),
                R"c( s. A positive one
 * pushes the joint's angle up. Which way round counts as positive does not matter, as long as it is
 * the same for all of these.
 *
)c");
}

std::string HeadComment(const CParts& parts, const CHeader& header) {
  const std::string& name = header.prefix;
  const std::string caps = UpperCase(name);
  const std::string period = FormatNumber(parts.period);
  const bool foreign = parts.task.state.empty();
  std::string states;
  std::vector<std::string> names;
  for (const NamedInput& input : parts.task.state) {
    names.push_back(input.name);
    states +=
        Concat(" *   ", input.name, std::string(8 - input.name.size(), ' '), input.meaning, '\n');
  }
  std::string goal = parts.task.goal;
  std::string when = period + " s";
  std::string input = Join(names, ", ");
  std::string apply = "set_motor";
  std::string inputs = PendulumInputs(parts, states);
  if (foreign) {
    goal = CommentText(parts.task.goal);
    when = "step";
    input = "observation";
    apply = "act";
    inputs = ForeignInputs(parts, caps);
  }
  size_t sample_bytes = 0;
  for (const CArray& array : parts.samples) sample_bytes += 4 * array.values.size();
  const std::string choice =
      parts.has_goal
          ? Concat(" *   ", name, "_goal(&state, 1, 0);   at any time: the pose to reach, 1 for a ",
                   "link that is to point up, else 0\n")
          : "";
  const std::string comment = Concat(
      "/* A policy that ", goal, ", as one C99 header.\n *\n",
      Paragraph(Concat(parts.origin, ". Written by Upswing ", UPSWING_VERSION, '.')),
      "\n *\n *   static ", name, "_state state;\n *   float torque;\n *   if (", name,
      "_selftest() != ", caps, "_OK) stop();\n *   ", name,
      "_init(&state);   before the first step, and after any pause\n", choice,
      " *   for (;;) {   every ", when, "\n *     ", name, "_control(&state, ", input,
      ", &torque);\n *     ", apply, "(torque);\n *   }\n *\n", inputs, PlantParagraph(parts),
      R"c( * The status reports null pointers and numbers that are not finite: the torque is then 0, and the
 * memory is cleared, as after )c",
      name, "_init", parts.has_goal ? "; the goal stays" : "", ".\n *\n",
      parts.note.empty() ? "" : Replaced(Paragraph(parts.note), "policy_", name + "_") + "\n *\n",
      Paragraph(Concat("Flash: ", header.constant_bytes, " bytes of constants, ", parts.code,
                       " of code, and ", sample_bytes,
                       " bytes of samples where the self test is "
                       "used; on AVR constants and samples lie in RAM, too. RAM: ",
                       header.state_bytes, " bytes of state. Stack of a call: arrays of ",
                       header.stack_bytes,
                       " bytes, and up to 200 bytes of frames besides those of "
                       "the math library. Work of a call: ",
                       parts.work)),
      "\n *\n * All arithmetic is in float. Nothing is allocated, and nothing is static but "
      "constants. */\n");
  return foreign ? Replaced(comment, "torque", "action") : comment;
}

}  // namespace

void AddEquations(const Plant& plant, int physics_steps, CParts& parts) {
  const Manipulator m = ManipulatorOf(plant);
  // In the order of the entries that extras/deploy/c/equations.c names.
  parts.constants.push_back(
      {"plant", "of the equations of motion",
       Floats(std::array{m.J1, m.J2, m.b, m.G1, m.G2, m.d1, m.d2, m.a, m.f1, m.f2})});
  parts.macros.emplace_back("PHYSICS_STEPS", Concat(physics_steps, " /* of a simulated period */"));
  parts.macros.emplace_back("ACTUATED_JOINT", Concat(plant.actuated_joint));
  if (plant.has_dry_friction()) {
    parts.macros.emplace_back("FRICTION_SLOPE", CLiteral(kFrictionSlope) + " /* s/rad */");
  }
}

void WriteHeader(const CParts& parts, CHeader& header) {
  header.state_bytes = parts.state_bytes;
  header.stack_bytes = parts.stack_bytes;
  for (const CArray& array : parts.constants) header.constant_bytes += 4 * array.values.size();
  const std::string& name = header.prefix;
  const std::string caps = UpperCase(name);
  std::string& text = header.text;
  text = Concat(HeadComment(parts, header), "#ifndef UPSWING_", caps, "_H\n#define UPSWING_", caps,
                "_H\n\n#include <math.h>\n#include <stdint.h>\n\n");
  const auto define = [&](const std::string& macro, const std::string& value) {
    text += Concat("#define ", caps, '_', macro, ' ', value, '\n');
  };
  const auto number = [](double value) { return CLiteral(static_cast<float>(value)); };
  define("PERIOD", number(parts.period) + " /* s, between two calls */");
  define("TORQUE_LIMIT",
         number(parts.limit) + (parts.task.state.empty() ? " /* no action is beyond it */"
                                                         : " /* N m, no torque is beyond it */"));
  define("CONSTANT_BYTES", Concat(header.constant_bytes, 'L'));
  for (const auto& [macro, value] : parts.macros) define(macro, value);
  define("TABLES", Concat(parts.constants.size()));
  define("CHECKSUM", Concat(ChecksumOf(parts.constants), "u /* of the tables */"));
  text += '\n';
  for (const CArray& array : parts.constants) text += ArrayText(array, name);
  text += parts.layers + TablesText(parts.constants, name);
  text += "/* Samples: states, one after the other, and what Upswing makes of them. */\n";
  for (const CArray& array : parts.samples) text += ArrayText(array, name);
  // Files in extras/deploy/c use the prefix "policy".
  const std::string code = Replaced(Expanded(parts.task.file), "policy_", name + "_");
  text += Concat('\n', Replaced(code, "POLICY_", caps + "_"), "\n#endif\n");
}

}  // namespace upswing::deploy
