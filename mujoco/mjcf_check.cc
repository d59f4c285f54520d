#include "mujoco/mjcf_check.h"

#include <tinyxml2.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/text.h"
#include "sim/double_pendulum.h"

namespace upswing {
namespace {

constexpr int kMostElements = 200;  // the built-in model has 15
constexpr int kMostLevels = 10;     // of nesting; the built-in model has 5
constexpr size_t kMostName = 100;   // bytes

/// What an attribute may hold: numbers, one of some words, or a name.
struct Attribute {
  std::string_view name;
  size_t least = 0, most = 0;   // count of numbers; 0: words or a name
  double low = 0, high = 0;     // of each number
  std::string_view words = {};  // the allowed words; empty: any name
};

/// An element, its attributes and the elements that it may contain.
struct Element {
  std::string_view name;
  std::vector<Attribute> attributes;
  std::string_view children = {};
};

constexpr std::string_view kBool = "false true";
constexpr double kAny = 1e6;  // bound of numbers without a narrower range

constexpr Attribute Name(std::string_view name) { return {name}; }
constexpr Attribute Word(std::string_view name, std::string_view words) {
  return {name, 0, 0, 0, 0, words};
}
constexpr Attribute Number(std::string_view name, double low = -kAny, double high = kAny) {
  return {name, 1, 1, low, high};
}
constexpr Attribute Numbers(std::string_view name, size_t least, size_t most, double low = -kAny,
                            double high = kAny) {
  return {name, least, most, low, high};
}

std::vector<Attribute> operator+(std::vector<Attribute> a, const std::vector<Attribute>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// The elements that a model may contain.
std::vector<Element> MakeElements() {
  constexpr std::string_view kSwitch = "enable disable";
  const std::vector<Attribute> named{Name("name"), Name("class")};
  const std::vector<Attribute> place{Numbers("pos", 3, 3),       Numbers("quat", 4, 4),
                                     Numbers("axisangle", 4, 4), Numbers("xyaxes", 6, 6),
                                     Numbers("zaxis", 3, 3),     Numbers("euler", 3, 3)};
  const std::vector<Attribute> look{Numbers("rgba", 4, 4, 0, 1), Number("group", 0, 5)};
  const std::vector<Attribute> shape{Numbers("size", 1, 3, 0), Numbers("fromto", 6, 6)};
  const std::vector<Attribute> contact{Number("contype", 0),   Number("conaffinity", 0),
                                       Number("condim", 1, 6), Numbers("friction", 1, 3, 0),
                                       Number("margin"),       Numbers("solref", 1, 2),
                                       Numbers("solimp", 1, 5)};
  return {
      {"mujoco",
       {Name("model")},
       "compiler option default worldbody actuator sensor contact keyframe"},
      {"compiler",
       {Word("angle", "degree radian"), Word("autolimits", kBool), Word("coordinate", "local"),
        Word("inertiafromgeom", "false true auto"), Name("eulerseq")}},
      {"option",
       // A shorter timestep makes an evaluation take minutes.
       {Number("timestep", 1e-4, kControlPeriod), Numbers("gravity", 3, 3),
        Word("integrator", "Euler RK4 implicit implicitfast"), Number("iterations", 1, 1000),
        Number("ls_iterations", 1, 1000), Number("tolerance", 0, 1), Number("ls_tolerance", 0, 1),
        Word("solver", "PGS CG Newton"), Word("jacobian", "dense sparse auto"),
        Word("cone", "pyramidal elliptic"), Number("density", 0), Number("viscosity", 0)},
       "flag"},
      // Without the flags that switch off gravity, springs, damping, the motor or its limit.
      {"flag",
       {Word("contact", kSwitch), Word("constraint", kSwitch), Word("equality", kSwitch),
        Word("frictionloss", kSwitch), Word("limit", kSwitch), Word("warmstart", kSwitch),
        Word("eulerdamp", kSwitch), Word("refsafe", kSwitch), Word("midphase", kSwitch),
        Word("nativeccd", kSwitch), Word("island", kSwitch), Word("energy", kSwitch),
        Word("sensor", kSwitch)}},
      {"default", {Name("class")}, "default joint geom site motor"},
      {"worldbody", {}, "body light camera site"},
      {"body", std::vector{Name("name"), Name("childclass")} + place,
       "joint geom body inertial light camera site"},
      {"inertial", std::vector{Number("mass", 0), Numbers("diaginertia", 3, 3, 0),
                               Numbers("fullinertia", 6, 6)} +
                       place},
      {"joint",
       named + std::vector{Word("type", "hinge slide ball free"), Numbers("axis", 3, 3),
                           Numbers("pos", 3, 3), Number("ref"), Number("springref"),
                           Number("stiffness", 0), Number("damping", 0), Number("armature", 0),
                           Number("frictionloss", 0), Word("limited", "false true auto"),
                           Numbers("range", 2, 2), Numbers("solreflimit", 1, 2),
                           Numbers("solimplimit", 1, 5), Numbers("solreffriction", 1, 2),
                           Numbers("solimpfriction", 1, 5), Number("margin"),
                           Number("group", 0, 5)}},
      {"geom", named +
                   std::vector{Word("type", "capsule sphere ellipsoid cylinder box plane"),
                               Number("mass", 0), Number("density", 0)} +
                   shape + place + look + contact},
      {"site", named + std::vector{Word("type", "capsule sphere ellipsoid cylinder box")} + shape +
                   place + look},
      {"camera", named +
                     std::vector{Word("mode", "fixed track trackcom targetbody targetbodycom"),
                                 Name("target"), Number("fovy", 0, 180)} +
                     place},
      {"light",
       named + std::vector{Word("mode", "fixed track trackcom targetbody targetbodycom"),
                           Name("target"), Word("type", "spot directional point"),
                           Word("directional", kBool), Word("castshadow", kBool),
                           Word("active", kBool), Numbers("pos", 3, 3), Numbers("dir", 3, 3),
                           Numbers("diffuse", 3, 3, 0), Numbers("ambient", 3, 3, 0),
                           Numbers("specular", 3, 3, 0), Numbers("attenuation", 3, 3, 0),
                           Number("cutoff", 0, 180), Number("exponent", 0)}},
      {"actuator", {}, "motor"},
      {"motor", named + std::vector{Name("joint"), Numbers("gear", 1, 6),
                                    Word("ctrllimited", "false true auto"),
                                    Numbers("ctrlrange", 2, 2), Number("group", 0, 5)}},
      {"sensor", {}, "jointpos jointvel actuatorfrc"},
      {"jointpos", {Name("name"), Name("joint")}},
      {"jointvel", {Name("name"), Name("joint")}},
      {"actuatorfrc", {Name("name"), Name("actuator")}},
      {"contact", {}, "exclude"},
      {"exclude", {Name("name"), Name("body1"), Name("body2")}},
      {"keyframe", {}, "key"},
      {"key",
       {Name("name"), Number("time"), Numbers("qpos", 2, 2), Numbers("qvel", 2, 2),
        Numbers("ctrl", 1, 1)}},
  };
}

/// The words of `text`, between any number of blanks.
std::vector<std::string> Words(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\n\r";
  std::vector<std::string> words;
  for (size_t at = 0; (at = text.find_first_not_of(kBlanks, at)) != std::string_view::npos;) {
    const size_t end = std::min(text.find_first_of(kBlanks, at), text.size());
    words.emplace_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

/// `text` in quotes; of a long text its beginning.
std::string Quoted(std::string_view text) {
  constexpr size_t kMostShown = 40;
  if (text.size() <= kMostShown) return Concat("\"", Printable(text), "\"");
  return Concat("\"", Printable(text.substr(0, kMostShown)), "…\"");
}

/// Checks one document; messages begin with `where`.
class Checker {
 public:
  explicit Checker(const std::string& where) : where_(where), elements_(MakeElements()) {}

  void Check(const std::string& mjcf) {
    tinyxml2::XMLDocument document;
    document.Parse(mjcf.data(), mjcf.size());
    if (document.Error()) {
      Refuse(document.ErrorLineNum(), Concat("not well-formed XML: ", ErrorText(document)));
    }
    for (const auto* node = document.FirstChild(); node != nullptr; node = node->NextSibling()) {
      if (node->ToDeclaration() == nullptr) CheckNode(*node, nullptr, 1);
    }
    if (count_ == 0) Refuse(1, "expected <mujoco>, got an empty XML document");
  }

 private:
  [[noreturn]] void Refuse(int line, std::string_view why) const {
    throw BadInput(Concat(where_, ":", line, ": ", why));
  }

  /// Such as "mismatched element".
  static std::string ErrorText(const tinyxml2::XMLDocument& document) {
    std::string text = document.ErrorName();
    for (const std::string_view prefix : {"XML_ERROR_", "XML_"}) {
      if (text.starts_with(prefix)) text.erase(0, prefix.size());
    }
    std::ranges::transform(text, text.begin(), [](char c) {
      return c == '_' ? ' ' : c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    return text;
  }

  /// Checks an element and its contents; only elements and comments are allowed.
  void CheckNode(const tinyxml2::XMLNode& node, const Element* parent, int level) {
    if (node.ToComment() != nullptr) return;
    const int line = node.GetLineNum();
    const tinyxml2::XMLElement* element = node.ToElement();
    if (element == nullptr) {
      Refuse(line, Concat("expected only elements and comments, got ", Quoted(node.Value())));
    }
    if (++count_ > kMostElements || level > kMostLevels) {
      Refuse(line, Concat("expected at most ", kMostElements, " elements, nested at most ",
                          kMostLevels, " deep"));
    }
    const Element& known = Find(*element, parent);
    for (const auto* a = element->FirstAttribute(); a != nullptr; a = a->Next()) {
      CheckAttribute(*a, known);
    }
    for (const auto* child = node.FirstChild(); child != nullptr; child = child->NextSibling()) {
      CheckNode(*child, &known, level + 1);
    }
  }

  const Element& Find(const tinyxml2::XMLElement& element, const Element* parent) const {
    const std::string name = element.Name();
    const std::vector<std::string> expected = Words(parent ? parent->children : "mujoco");
    if (std::ranges::find(expected, name) == expected.end()) {
      const std::string place = parent ? Concat(" in <", parent->name, ">") : "";
      Refuse(element.GetLineNum(),
             Concat("expected ",
                    expected.empty() ? "nothing" : Concat("<", Join(expected, ">, <"), ">"), place,
                    ", got ", Quoted(name), DidYouMean(name.substr(0, kMostName), expected)));
    }
    return *std::ranges::find(elements_, name, &Element::name);
  }

  void CheckAttribute(const tinyxml2::XMLAttribute& attribute, const Element& element) const {
    const int line = attribute.GetLineNum();
    const std::string name = attribute.Name();
    const auto known = std::ranges::find(element.attributes, name, &Attribute::name);
    if (known == element.attributes.end()) {
      std::vector<std::string> names;
      for (const Attribute& a : element.attributes) names.emplace_back(a.name);
      Refuse(line, Concat("<", element.name, "> takes no ", Quoted(name), " here",
                          DidYouMean(name.substr(0, kMostName), names), "; expected ",
                          names.empty() ? "no attribute" : Join(names, ", ")));
    }
    const std::string_view text = attribute.Value();
    const std::string expected = Expected(*known, text);
    if (expected.empty()) return;
    Refuse(line,
           Concat("<", element.name, "> ", name, ": expected ", expected, ", got ", Quoted(text)));
  }

  /// What was expected; empty if the text is valid.
  static std::string Expected(const Attribute& attribute, std::string_view text) {
    if (attribute.most > 0) return ExpectedNumbers(attribute, text);
    const bool fits = text.size() <= kMostName && Printable(text) == text;
    if (attribute.words.empty()) {
      return fits ? "" : Concat("a name of at most ", kMostName, " bytes");
    }
    const std::vector<std::string> words = Words(attribute.words);
    if (std::ranges::find(words, text) != words.end()) return "";
    return Join(words, " or ");
  }

  static std::string ExpectedNumbers(const Attribute& a, std::string_view text) {
    const std::vector<std::string> words = Words(text);
    const auto fits = [&](const std::string& word) {
      const auto number = ParseNumber(word);
      return number && *number >= a.low && *number <= a.high;
    };
    if (words.size() >= a.least && words.size() <= a.most && std::ranges::all_of(words, fits)) {
      return "";
    }
    const std::string count = a.least == a.most ? Concat(a.most) : Concat(a.least, " to ", a.most);
    return Concat(a.most == 1 ? "a number" : count + " numbers", " in [", FormatNumber(a.low), ", ",
                  FormatNumber(a.high), "]");
  }

  const std::string& where_;
  std::vector<Element> elements_;
  int count_ = 0;  // elements so far
};

}  // namespace

void CheckMjcf(const std::string& mjcf, const std::string& where) {
  if (mjcf.size() > kMostMjcfBytes) {
    throw BadInput(
        Concat(where, ": expected MJCF of at most ", kMostMjcfBytes, " bytes, got ", mjcf.size()));
  }
  std::string text = mjcf.starts_with("\xef\xbb\xbf") ? mjcf.substr(3) : mjcf;  // the mark of UTF-8
  std::ranges::replace_if(
      text, [](char c) { return c == '\t' || c == '\n' || c == '\r'; }, ' ');
  if (Printable(text) != text) {
    throw BadInput(Concat(where, ": expected UTF-8 text without control characters"));
  }
  Checker(where).Check(mjcf);
}

}  // namespace upswing
