// Stand-ins for the streams and locales of muParser's sources, which build.py includes first in
// each. The locales of libc++ would be a tenth of the module. Numbers are as in the C locale.
#pragma once

#include <charconv>
#include <iostream>
#include <locale>
#include <sstream>
#include <string>

namespace std {

template <class Char>
struct small_numpunct {
  virtual ~small_numpunct() = default;
  Char decimal_point() const { return do_decimal_point(); }
  Char thousands_sep() const { return do_thousands_sep(); }

 protected:
  virtual Char do_decimal_point() const { return '.'; }
  virtual Char do_thousands_sep() const { return 0; }
  virtual string do_grouping() const { return {}; }
};

/// The C locale, whatever is asked for.
struct small_locale {
  explicit small_locale(const char*) {}
  template <class Facet>
  small_locale(const small_locale&, Facet* facet) {
    delete facet;
  }
  static small_locale classic() { return small_locale("C"); }
};

template <class Facet>
Facet small_use_facet(const small_locale&) {
  return Facet('.');
}
template <>
inline small_numpunct<char> small_use_facet(const small_locale&) {
  return {};
}

/// Where muParser prints for debugging. Drops everything.
struct small_ostream {
  small_ostream& operator<<(ostream& (*)(ostream&)) { return *this; }
  template <class Any>
  small_ostream& operator<<(const Any&) {
    return *this;
  }
};
inline small_ostream small_cout;

/// A text that grows by texts and integers, and can be read as one number.
template <class, class, class>
class small_stringstream {
 public:
  using pos_type = ptrdiff_t;

  explicit small_stringstream(string text = "") : text_(std::move(text)) {}
  string str() const { return text_; }
  void seekg(pos_type) {}
  void imbue(const small_locale&) {}
  pos_type tellg() const { return at_; }  // -1 after a text that is no number

  small_stringstream& operator>>(double& value) {
    const size_t first = min(text_.find_first_not_of(" \t\n\r\f\v"), text_.size());
    const char* start = text_.data() + first;
    const auto [end, error] = from_chars(start, text_.data() + text_.size(), value);
    const bool is_number = error == errc() && (isdigit(*start) || *start == '.');
    at_ = is_number ? end - text_.data() : -1;
    return *this;
  }

  small_stringstream& operator<<(const string& text) {
    text_ += text;
    return *this;
  }
  small_stringstream& operator<<(size_t value) { return *this << to_string(value); }
  small_stringstream& operator<<(int value) { return *this << to_string(value); }
  small_stringstream& operator<<(ios_base& (*)(ios_base&)) { return *this; }

 private:
  string text_;
  pos_type at_ = 0;
};

}  // namespace std

#define basic_stringstream small_stringstream
#define cout small_cout
#define locale small_locale
#define numpunct small_numpunct
#define ostream small_ostream
#define use_facet small_use_facet
